#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Heats the head to 110 degC, lets the sensor slip out of its seat, and draws what the chip does: heat_the_chip.png."""
# %% Run the chip on its simulated head
import matplotlib.pyplot as plt
import meltstage

run = meltstage.play("1 set SETPOINT 110\n1.2 run\n420 seat 0.2", for_s=480)
print(run.fault)
# %% Draw temperatures and duty
figure, (degc, duty) = plt.subplots(2, sharex=True, height_ratios=(3, 1), layout="constrained")
for field in ("set_point_degc", "reading_degc", "block_degc", "heater_degc"):
    degc.plot(run.trace["time_s"], run.trace[field], label=field.removesuffix("_degc").replace("_", " "))
degc.set(ylabel="degC")
degc.legend()
duty.plot(run.trace["time_s"], run.trace["duty_percent"])
duty.set(xlabel="s", ylabel="duty, %")
figure.savefig("heat_the_chip.png", dpi=120)
