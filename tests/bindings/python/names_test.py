# SPDX-License-Identifier: Apache-2.0
"""The package's names: all are told of, and the stub of the C++ side has its functions with their arguments."""
import ast
import inspect
import pathlib
import re
import unittest

import meltstage
from meltstage import _core

FOLDER = pathlib.Path(meltstage.__file__).parent


def told_constants() -> set[str]:
    """Constants with a docstring below them."""
    found = set()
    for source in FOLDER.glob("*.py"):
        body = ast.parse(source.read_text()).body
        for assignment, text in zip(body, body[1:]):
            if isinstance(assignment, (ast.Assign, ast.AnnAssign)) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                target = assignment.target if isinstance(assignment, ast.AnnAssign) else assignment.targets[0]
                found.add(target.id)
    return found


def public(things) -> list[str]:
    return [name for name in things if not name.startswith("_")]


class Names(unittest.TestCase):
    def test_what_is_public_is_exported(self):
        modules = {path.stem for path in FOLDER.glob("*.py")}
        self.assertEqual(sorted(set(public(vars(meltstage))) - modules), sorted(set(meltstage.__all__) - {"__version__"}))

    def test_every_name_is_told_of(self):
        told = told_constants()
        for name in public(meltstage.__all__):
            thing = getattr(meltstage, name)
            if not (inspect.isclass(thing) or inspect.isfunction(thing)):
                self.assertIn(name, told)
                continue
            self.assertTrue(inspect.getdoc(thing), name)
            if not inspect.isclass(thing) or not thing.__module__.startswith("meltstage"):
                continue
            for member in public(vars(thing)):
                value = vars(thing)[member]
                if inspect.isfunction(value) or isinstance(value, property):
                    self.assertTrue(inspect.getdoc(value), f"{name}.{member}")

    def test_the_stub_has_the_functions_of_the_module(self):
        stub = ast.parse((FOLDER / "_core.pyi").read_text())
        functions, constants = {}, set()
        for node in stub.body:
            if isinstance(node, ast.FunctionDef):
                functions[node.name] = node
            elif isinstance(node, ast.AnnAssign):
                constants.add(node.target.id)
            elif isinstance(node, ast.ClassDef):
                for member in node.body:
                    functions[f"{node.name}.{member.name if isinstance(member, ast.FunctionDef) else member.target.id}"] = member
        there = {}
        for name, thing in vars(_core).items():
            if inspect.isclass(thing):
                made_here = (thing.__init__.__doc__ or "").startswith("__init__(")
                members = public(vars(thing)) + ["__init__"] * made_here
                there.update({f"{name}.{member}": vars(thing)[member] for member in members})
            elif callable(thing):
                there[name] = thing
        self.assertEqual(sorted(functions), sorted(there))
        values = {name for name in public(vars(_core)) if isinstance(getattr(_core, name), (int, dict, list))}
        self.assertEqual(constants - {"__version__"}, values)
        for name, node in functions.items():
            if isinstance(node, ast.FunctionDef) and not node.decorator_list:
                signature = there[name].__doc__.splitlines()[0]
                arguments = [word for word in re.findall(r"(\w+): ", signature)]
                self.assertEqual(arguments, [argument.arg for argument in node.args.args], signature)


if __name__ == "__main__":
    unittest.main()
