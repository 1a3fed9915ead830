"""Options as the command line writes them."""

import json
import os
from typing import Mapping, Optional


def settings(options: Optional[Mapping[str, object]]) -> list[str]:
    """{"smoother.refine": "batch"} as ["smoother.refine=batch"]: arguments of --set."""
    return [f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in (options or {}).items()]


def paths(files) -> list[str]:
    """One path or several as a list of texts."""
    return [os.fspath(files)] if isinstance(files, (str, os.PathLike)) else [os.fspath(file) for file in files]
