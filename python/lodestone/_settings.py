"""Options as the command line writes them."""

import json
import os
from typing import Mapping, Optional

import numpy as np


def _python_value(value: object) -> object:
    """Numbers and arrays of numpy as those of Python, for json. float32 keeps its digits: 0.1 stays 0.1."""
    if isinstance(value, np.floating):
        return float(str(value))
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return list(value) if value.ndim else value[()]
    raise TypeError(f"expected a text, a number, a bool or a list, found {type(value).__name__}")


def _text(key: str, value: object) -> str:
    try:
        return value if isinstance(value, str) else json.dumps(value, default=_python_value)
    except TypeError as error:
        raise TypeError(f"options: {key}: {error}") from None


def settings(options: Optional[Mapping[str, object]]) -> list[str]:
    """{"smoother.refine": "batch"} as ["smoother.refine=batch"]: arguments of --set."""
    if options is None:
        return []
    if not isinstance(options, Mapping):
        raise TypeError('options: expected a mapping, such as {"smoother.refine": "batch"}, found '
                        f"{type(options).__name__} {options!r}")
    return [f"{key}={_text(key, value)}" for key, value in options.items()]


def paths(files) -> list[str]:
    """One path or several as a list of texts."""
    return [os.fspath(files)] if isinstance(files, (str, os.PathLike)) else [os.fspath(file) for file in files]
