"""The stubs name what the compiled module has, and everything for users is documented."""

import ast
import inspect
import unittest
from pathlib import Path

import lodestone
from lodestone import _lodestone

STUBS = Path(lodestone.__file__).with_name("_lodestone.pyi")


def public(names):
    return {name for name in names if not name.startswith("_")}


class StubsTest(unittest.TestCase):
    def test_names_are_those_of_the_module(self):
        stubs = {node.name: node for node in ast.parse(STUBS.read_text(encoding="utf-8")).body
                 if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        self.assertEqual(set(stubs), public(dir(_lodestone)))
        for name, node in stubs.items():
            if isinstance(node, ast.ClassDef) and name != "InputError":
                members = public(one.name for one in node.body if isinstance(one, ast.FunctionDef))
                self.assertEqual(members, public(dir(getattr(_lodestone, name))), name)

    def test_arguments_are_those_of_the_module(self):
        for node in ast.walk(ast.parse(STUBS.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
                continue
            compiled = getattr(_lodestone, node.name, None)
            if compiled is None or not callable(compiled):
                continue
            signature = compiled.__doc__.splitlines()[0]
            for argument in node.args.args:
                self.assertIn(f"{argument.arg}: ", signature, node.name)

    def test_everything_for_users_has_a_docstring(self):
        for name in lodestone.__all__:
            one = getattr(lodestone, name)
            if not isinstance(one, str):
                self.assertTrue(inspect.getdoc(one), name)
        for method in ("add_imu", "add_field", "add_wheels", "add_scan", "imu", "field", "wheels", "scans"):
            self.assertIn(" ", inspect.getdoc(getattr(lodestone.Measurements, method)), method)

    def test_the_package_is_typed(self):
        self.assertTrue(STUBS.with_name("py.typed").exists())


if __name__ == "__main__":
    unittest.main()
