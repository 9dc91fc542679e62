#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# flipped_dsp_bit.sh FOLDER FPGA: passes when the replay finds one flipped bit of a DSP block (a factor taken as unsigned) in a copy of a UP5K's finished
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
for x, y in sorted(device.dsp_tiles[0]):
    column, row, name = device.get_dsp_config_db(x, y)["A_SIGNED"]
    bits = next(entry[0] for entry in device.tile_db(column, row) if entry[1:] == ["IpConfig", name])
    line, place = (int(part) for part in bits[0][1:-1].split("["))
    tile = device.tile(column, row)
    if tile[line][place] == "1":
        tile[line] = tile[line][:place] + "0" + tile[line][place + 1:]
        device.write_file("flipped.asc")
        sys.exit()
sys.exit("flipped_dsp_bit: found no DSP block with signed factors")
END
icepack flipped.asc harness.bin
rm -rf bitstream.v replay.txt bitstream.dir
{ make -s -C "$fpga" BOARD=up5k TOP=tc_paramc REPLAY_CLOCKS=20000 out="$work" "$work/replay.txt" 2>&1 || true; } | tee log
grep -qE "[1-9][0-9]* mismatches" log
