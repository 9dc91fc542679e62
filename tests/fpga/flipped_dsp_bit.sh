#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# flipped_dsp_bit.sh FOLDER FPGA: passes when the replay finds one flipped bit of a DSP block (which of its results is its output) in a copy of a UP5K's finished
# bitstream.
set -euo pipefail
folder=$1 fpga=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -r "$folder/." "$work"
cd "$work"
/usr/bin/python3 - <<'END'
import sys
sys.path.insert(0, "/usr/share/fpga-icestorm/python")
import icebox
device = icebox.iceconfig()
device.read_file("unpacked.asc")


def find(place):
    """The tile of a bit, and where in it the bit stands."""
    column, row, name = place
    bits = next(entry[0] for entry in device.tile_db(column, row) if entry[1:] == ["IpConfig", name])
    line, position = (int(part) for part in bits[0][1:-1].split("["))
    return device.tile(column, row), line, position


for x, y in sorted(device.dsp_tiles[0]):
    places = device.get_dsp_config_db(x, y)
    if all(tile[line][position] == "0" for tile, line, position in map(find, places.values())):
        continue
    tile, line, position = find(places["BOTOUTPUT_SELECT_0"])
    tile[line] = tile[line][:position] + str(1 - int(tile[line][position])) + tile[line][position + 1:]
    device.write_file("flipped.asc")
    sys.exit()
sys.exit("flipped_dsp_bit: found no DSP block in use")
END
icepack flipped.asc harness.bin
rm -rf bitstream.v replay.txt bitstream.dir
{ make -s -C "$fpga" BOARD=up5k TOP=tc_paramc REPLAY_CLOCKS=100000 out="$work" "$work/replay.txt" 2>&1 || true; } | tee log
grep -qE "[1-9][0-9]* mismatches" log
