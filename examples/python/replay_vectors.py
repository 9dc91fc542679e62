#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Records the chip's pins, replays them on the model, and draws some of them: replay_vectors.mvec, replay_vectors.png."""
# %% Record and replay; `meltstage print` leaves such a recording, too
import matplotlib.pyplot as plt
import meltstage
import numpy as np

meltstage.play("0.1 set SETPOINT 110\n0.2 run", for_s=1).record("replay_vectors.mvec")
recording = meltstage.read_recording("replay_vectors.mvec")
replay = recording.replay()
print(f"{replay.cycles} cycles agree; first mismatch: {replay.mismatch}")
# %% Draw the host's write and the chip's answer
cycles = np.arange(1_195_000, 1_230_000)
figure, axes = plt.subplots(3, sharex=True, layout="constrained")
for axis, name in zip(axes, ("uart_rx_i", "uart_tx_o", "uart_de_o")):
    axis.plot(cycles / recording.clock_hz * 1e3, recording.at(name, cycles), drawstyle="steps-post", linewidth=1)
    axis.set(ylim=(-0.2, 1.2), yticks=(0, 1))
    axis.set_ylabel(name, rotation=0, horizontalalignment="right")
axes[-1].set(xlabel="ms")
figure.savefig("replay_vectors.png", dpi=120)
