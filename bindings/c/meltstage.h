/* SPDX-License-Identifier: Apache-2.0
 *
 * Meltstage for C, and for every language that calls C: the chip's model, its bench, and motion.
 *
 * Each function that can fail returns an ms_status; ms_last_error() then has one line: what, where, found, expected. Results go through
 * pointers and are left alone on failure. A NULL where something is needed is MS_NULL, never a crash. Names are the chip's own
 * (docs/chip/registers.md); text is UTF-8. No C++ exception leaves a function.
 *
 * A handle is used by one thread at a time; handles of their own may be used in several threads at once. What ms_..._new() and the like
 * hand out is given back to ms_..._free(), which takes NULL, too.
 *
 * Symbols carry the version MELTSTAGE_0.1. A function keeps its meaning as long as the library is libmeltstage.so.0.
 */
#ifndef MELTSTAGE_H
#define MELTSTAGE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum ms_status {
  MS_OK = 0,
  MS_WRONG = 1,     /* a value, name, scenario or file that the caller can put right */
  MS_REFUSED = 2,   /* the chip answers the host with an exception code */
  MS_NULL = 3,      /* NULL where something is needed */
  MS_NO_MEMORY = 4, /* out of memory */
  MS_FAILED = 5     /* anything else: a disk that is full, a defect of this library */
} ms_status;

/* "0.1.0". */
const char *ms_version(void);
/* What the last failed call of this thread found, in one line; "" before one failed. It stands until the next failure of the thread. */
const char *ms_last_error(void);

/* ---- The chip: exact at every clock ---- */

typedef struct ms_chip ms_chip;

/* Flops in reset, pins at rest, reset released: after some clocks it runs. */
ms_status ms_chip_new(ms_chip **chip);
/* The whole state: flops, pins and cycle. */
ms_status ms_chip_copy(const ms_chip *chip, ms_chip **copy);
void ms_chip_free(ms_chip *chip);

/* Clocks the chip, one clock after the other (12 MHz), with the pins as they stand. */
ms_status ms_chip_step(ms_chip *chip, uint64_t clocks);
/* Ends in the same state in a fraction of the time: clocks in which the chip only counts are left out. 2^62 clocks at most. */
ms_status ms_chip_advance(ms_chip *chip, uint64_t clocks);
/* Clocks since the chip was made. */
ms_status ms_chip_cycle(const ms_chip *chip, uint64_t *cycle);

/* Level of any pin now: "heater_o". */
ms_status ms_chip_pin(const ms_chip *chip, const char *pin, uint64_t *level);
/* Level of an input pin from the next clock on: "inhibit_i". */
ms_status ms_chip_set_pin(ms_chip *chip, const char *pin, uint64_t level);

/* A register's value in its unit, looked at without being a host. PV is NaN before the first sample. */
ms_status ms_chip_peek(const ms_chip *chip, const char *reg, double *value);
/* The same as a host on the serial line reads it: it counts as a message and feeds the host watchdog. */
ms_status ms_chip_read(ms_chip *chip, const char *reg, double *value);
/* A value in the register's unit, to its nearest step, as a host writes it. */
ms_status ms_chip_write(ms_chip *chip, const char *reg, double value);
/* A command: "run", "stop", "clear", "tune", "hold", "commit" or "discard". */
ms_status ms_chip_command(ms_chip *chip, const char *word);

/* A flop as a number without sign: "guard.run_q", "mem.active_q[3]". Setting one is what a particle does. */
ms_status ms_chip_flop(const ms_chip *chip, const char *flop, uint64_t *value);
ms_status ms_chip_set_flop(ms_chip *chip, const char *flop, uint64_t value);
/* Name of the main state machine's state; it stands for good. */
ms_status ms_chip_state(const ms_chip *chip, const char **name);

/* ---- The bench: the chip on its simulated, heated head, by a scenario (docs/start/chip-in-a-page.md) ---- */

typedef struct ms_run ms_run;

typedef struct ms_trace_row {
  double time_s;
  double set_point_degc; /* the working set-point */
  double reading_degc;   /* of the chip; NaN before the first sample */
  double block_degc;
  double heater_degc;
  double duty_percent;
  double state;       /* code of the main state machine */
  double faults;      /* bits that are latched */
  double pin_changes; /* so far */
  double pins_hash;   /* of all pins, their levels and clocks */
} ms_trace_row;

/* From power-up. "" is a scenario, too: the chip is powered and polled. */
ms_status ms_run_new(const char *scenario, ms_run **run);
void ms_run_free(ms_run *run);
/* On to a time since power-up, in s (0 to 1e9); not back. */
ms_status ms_run_until(ms_run *run, double time_s);
/* One thing at a time in s, or now when that is over: "set SETPOINT 120", "sensor open". */
ms_status ms_run_do(ms_run *run, const char *event, double at_s);
/* A row each tenth of a second. The rows stand until the next call with this run that isn't for a const one. */
ms_status ms_run_trace(const ms_run *run, const ms_trace_row **rows, size_t *count);
/* How many requests of events the chip refused or has not answered. */
ms_status ms_run_failed(const ms_run *run, uint64_t *count);
/* The fault that latched first, in a sentence; "" without one. At most `size` bytes with the 0 at their end go to `text`; `needed`, which
 * may be NULL, is told how many the whole sentence takes. `text` may be NULL when `size` is 0. */
ms_status ms_run_fault(const ms_run *run, char *text, size_t size, size_t *needed);
/* A copy of the chip as it is now. */
ms_status ms_run_chip(const ms_run *run, ms_chip **copy);
/* All pins since power-up as a recording (.mvec). */
ms_status ms_run_record(const ms_run *run, const char *path);

/* ---- Motion of an axis. mm, mm/s, mm/s^2, mm/s^3, s ---- */

typedef struct ms_profile ms_profile;

typedef struct ms_limits { /* each above 0; the jerks are those of segments 1, 3, 5 and 7 of an S-curve */
  double velocity_mm_s;
  double acceleration_mm_s2;
  double deceleration_mm_s2;
  double jerk1_mm_s3, jerk3_mm_s3, jerk5_mm_s3, jerk7_mm_s3;
} ms_limits;

typedef struct ms_motion_state {
  double position_mm;
  double velocity_mm_s;
  double acceleration_mm_s2;
  double jerk_mm_s3; /* not looked at where a state is given */
} ms_motion_state;

/* Those that the library begins with. */
ms_limits ms_default_limits(void);

/* The fastest S-curve over a distance (>= 0) from one speed to another, each 0 to the limit. */
ms_status ms_profile_scurve(const ms_limits *limits, double distance_mm, double start_velocity_mm_s, double end_velocity_mm_s,
                            ms_profile **profile);
/* The fastest motion from any state to any other; positions of the profile are those of the states. */
ms_status ms_profile_to_state(const ms_limits *limits, const ms_motion_state *state, const ms_motion_state *end, ms_profile **profile);
/* From any state to a target that is passed with a speed after exactly that time. */
ms_status ms_profile_arrival(const ms_limits *limits, const ms_motion_state *state, double target_mm, double end_velocity_mm_s,
                             double duration_s, ms_profile **profile);
void ms_profile_free(ms_profile *profile);
ms_status ms_profile_duration(const ms_profile *profile, double *duration_s);
/* The states at `count` times, into as many states. */
ms_status ms_profile_sample(const ms_profile *profile, const double *times_s, size_t count, ms_motion_state *states);

/* ---- The order in which points are visited ---- */

typedef struct ms_tour ms_tour;

typedef enum ms_metric { MS_MANHATTAN = 0, MS_CHEBYSHEV = 1, MS_EUCLIDEAN = 2 } ms_metric;

/* `points_mm`: x and y of the first point, of the second one and so on. The way begins at `start_mm` (x, y) and ends at `end_mm`; NULL:
 * anywhere. A closed one (closed != 0) returns to where it began, and has no end. */
ms_status ms_tour_plan(const double *points_mm, size_t count, ms_metric metric, int closed, const double *start_mm, const double *end_mm,
                       ms_tour **tour);
void ms_tour_free(ms_tour *tour);
/* Indices of the points in their order; they stand until the tour is freed. */
ms_status ms_tour_order(const ms_tour *tour, const size_t **order, size_t *count);
/* mm: in the order that was given, in the planned one, and the bound below which no order lies. Each may be NULL. */
ms_status ms_tour_length(const ms_tour *tour, double *before_mm, double *planned_mm, double *bound_mm);

#ifdef __cplusplus
}
#endif

#endif /* MELTSTAGE_H */
