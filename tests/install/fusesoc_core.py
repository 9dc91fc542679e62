#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""fusesoc_core.py CORE TARGET...: does with targets of a .core file (CAPI2) what FuseSoC does: collects the files of their file sets, in
order, and has Verilator read them with the target's options. FuseSoC itself is no Debian package. The files must also be those of tc.f.
Exit status: 0 all is well, 1 it isn't (one line says what)."""
import pathlib
import subprocess
import sys

import yaml

TOOL_MODES = {"lint-only": "--lint-only", "binary": "--lint-only"}  # reading is enough here; rtl_kit.sh builds the example
MARK = "CAPI=2:"


def files_of(core, file_set):
    """Names and attributes of a file set's files, those of the set filled in."""
    whole = core["filesets"][file_set]
    for entry in whole["files"]:
        name, own = next(iter(entry.items())) if isinstance(entry, dict) else (entry, {})
        yield name, {"file_type": whole.get("file_type"), **own}


def check_target(core, root, name):
    target = core["targets"][name]
    options = target.get("tools", {}).get("verilator", {})
    command = ["verilator", TOOL_MODES[options.get("mode", "lint-only")], *options.get("verilator_options", []), "--top-module", target["toplevel"]]
    for file_set in target["filesets"]:
        for file, attributes in files_of(core, file_set):
            if not (root / file).is_file():
                raise SystemExit(f"{root}: target {name}: {file} is not there")
            if attributes.get("is_include_file"):
                command.append(f"-I{(root / file).parent}")
            elif attributes["file_type"] in ("systemVerilogSource", "verilogSource", "vlt"):
                command.append(str(root / file))
            else:
                raise SystemExit(f"{root}: {file}: file type {attributes['file_type']} isn't one of FuseSoC's")
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode or "%Warning" in done.stderr:
        raise SystemExit(f"target {name}: {done.stderr.splitlines()[0]}")


def main():
    path = pathlib.Path(sys.argv[1])
    text = path.read_text()
    if not text.startswith(MARK + "\n"):
        raise SystemExit(f"{path}:1: expected {MARK}")
    core = yaml.safe_load(text)
    named = [name for name, attributes in files_of(core, "rtl") if not attributes.get("is_include_file")]
    listed = [line for line in (path.parent / "tc.f").read_text().split() if not line.startswith("+")]
    if named != listed:
        raise SystemExit(f"{path}: the files of file set rtl aren't those of tc.f: {sorted(set(named) ^ set(listed)) or 'another order'}")
    for name in sys.argv[2:]:
        check_target(core, path.parent, name)


main()
