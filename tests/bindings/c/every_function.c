/* SPDX-License-Identifier: Apache-2.0
 * every_function FOLDER: calls each function of meltstage.h from C, rightly and wrongly. Exits 1 with the line of what is not so. */
#include <math.h>
#include <meltstage.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

static void check(int good, const char *what, int line) {
  if (good) return;
  fprintf(stderr, "line %d: not so: %s; last error: %s\n", line, what, ms_last_error());
  ++failures;
}
#define CHECK(condition) check((condition), #condition, __LINE__)
#define GOOD(call) check((call) == MS_OK, #call, __LINE__)

/* The call ends with that status, and its line of text holds `words`. */
static void ends(ms_status found, ms_status expected, const char *words, int line) {
  check(found == expected && strstr(ms_last_error(), words) != NULL && strchr(ms_last_error(), '\n') == NULL, words, line);
}
#define ENDS(call, status, words) ends((call), (status), (words), __LINE__)

static void chip(void) {
  ms_chip *chip = NULL, *copy = NULL;
  uint64_t number = 7;
  double value = 0.0;
  const char *state = NULL;
  GOOD(ms_chip_new(&chip));
  GOOD(ms_chip_step(chip, 1000));
  GOOD(ms_chip_cycle(chip, &number));
  CHECK(number == 1000);
  GOOD(ms_chip_peek(chip, "PV", &value));
  CHECK(isnan(value));
  GOOD(ms_chip_write(chip, "SETPOINT", 110.04));
  GOOD(ms_chip_advance(chip, 2000000));
  GOOD(ms_chip_read(chip, "SETPOINT", &value));
  CHECK(fabs(value - 110.0) < 1e-9);
  GOOD(ms_chip_command(chip, "stop"));
  GOOD(ms_chip_state(chip, &state));
  CHECK(state != NULL && strlen(state) > 2);

  GOOD(ms_chip_copy(chip, &copy));
  GOOD(ms_chip_set_pin(copy, "inhibit_i", 1));
  GOOD(ms_chip_step(copy, 10));
  GOOD(ms_chip_pin(copy, "fault_no", &number));
  CHECK(number == 0);
  GOOD(ms_chip_pin(chip, "fault_no", &number)); /* the copy went its own way */
  CHECK(number == 1);
  GOOD(ms_chip_set_flop(chip, "mem.active_q[3]", 5));
  GOOD(ms_chip_flop(chip, "mem.active_q[3]", &number));
  CHECK(number == 5);

  number = 7;
  ENDS(ms_chip_pin(chip, "heater", &number), MS_WRONG, "pin: found \"heater\", expected one of rst_ni, ");
  CHECK(number == 7);
  ENDS(ms_chip_pin(chip, NULL, &number), MS_NULL, "pin: found NULL");
  ENDS(ms_chip_pin(chip, "heater_o", NULL), MS_NULL, "level: found NULL");
  ENDS(ms_chip_set_pin(chip, "heater_o", 1), MS_WRONG, "pin: found \"heater_o\"");
  ENDS(ms_chip_set_pin(chip, "addr_strap_i", 8), MS_WRONG, "addr_strap_i: found 8, expected 0 to 7");
  ENDS(ms_chip_write(chip, "SETPOINT", 600.0), MS_WRONG, "SETPOINT: found 600, expected 0.0 to 500.0 degC");
  ENDS(ms_chip_write(chip, "SETPOINT", NAN), MS_WRONG, "SETPOINT: found nan");
  ENDS(ms_chip_write(chip, "SETPOINT", 400.0), MS_REFUSED, "write SETPOINT: the chip refuses with exception 3");
  ENDS(ms_chip_write(chip, "PV", 1.0), MS_WRONG, "register: found PV");
  ENDS(ms_chip_write(chip, "\n\xff", 1.0), MS_WRONG, "register: found \"\\x0A\\xFF\"");
  ENDS(ms_chip_peek(chip, "CMD", &value), MS_WRONG, "register: found CMD, expected one that can be read");
  ENDS(ms_chip_read(chip, "PV", NULL), MS_NULL, "value: found NULL");
  ENDS(ms_chip_command(chip, "explode"), MS_WRONG, "command: found \"explode\", expected one of run, stop");
  ENDS(ms_chip_flop(chip, "guard.run", &number), MS_WRONG, "flop: found \"guard.run\"");
  ENDS(ms_chip_set_flop(chip, "guard.run_q", 2), MS_WRONG, "guard.run_q: found 0x2, expected bits of 0x1 alone");
  ENDS(ms_chip_new(NULL), MS_NULL, "chip: found NULL");
  ENDS(ms_chip_copy(NULL, &copy), MS_NULL, "chip: found NULL");
  ENDS(ms_chip_step(NULL, 1), MS_NULL, "chip: found NULL");
  ENDS(ms_chip_advance(NULL, 1), MS_NULL, "chip: found NULL");
  ENDS(ms_chip_advance(chip, UINT64_MAX), MS_WRONG, "clocks: found 18446744073709551615, expected 0 to 4611686018427387904");
  ENDS(ms_chip_cycle(chip, NULL), MS_NULL, "cycle: found NULL");
  ENDS(ms_chip_state(chip, NULL), MS_NULL, "name: found NULL");
  ms_chip_free(copy);
  ms_chip_free(chip);
  ms_chip_free(NULL);
}

static void run(const char *folder) {
  ms_run *run = NULL;
  ms_chip *chip = NULL;
  const ms_trace_row *rows = NULL;
  size_t count = 0, needed = 0;
  uint64_t number = 0;
  char text[20], path[1000];
  GOOD(ms_run_new("head PH-A\n1 set SETPOINT 60\n1.2 run", &run));
  GOOD(ms_run_until(run, 30.0));
  GOOD(ms_run_trace(run, &rows, &count));
  CHECK(count == 301 && fabs(rows[300].time_s - 30.0) < 1e-9 && rows[300].block_degc > rows[0].block_degc + 1.0);
  CHECK(rows[300].set_point_degc > 59.0 && isnan(rows[0].reading_degc));
  GOOD(ms_run_failed(run, &number));
  CHECK(number == 0);
  GOOD(ms_run_fault(run, text, sizeof text, &needed));
  CHECK(needed == 1 && text[0] == '\0');
  GOOD(ms_run_do(run, "estop on", 0.0));
  GOOD(ms_run_until(run, 30.5));
  GOOD(ms_run_fault(run, text, sizeof text, &needed));
  CHECK(needed > sizeof text && strlen(text) == sizeof text - 1 && strncmp(text, "Inhibit: ", 9) == 0);
  GOOD(ms_run_fault(run, NULL, 0, NULL));
  GOOD(ms_run_chip(run, &chip));
  GOOD(ms_chip_pin(chip, "inhibit_i", &number));
  CHECK(number == 1);
  snprintf(path, sizeof path, "%s/every_function.mvec", folder);
  GOOD(ms_run_record(run, path));
  remove(path);

  snprintf(path, sizeof path, "%s/no/folder/here.mvec", folder);
  ENDS(ms_run_record(run, path), MS_WRONG, "no/folder");
  ENDS(ms_run_record(run, NULL), MS_NULL, "path: found NULL");
  ENDS(ms_run_until(run, NAN), MS_WRONG, "time_s: found nan, expected 0 to 1e+09");
  ENDS(ms_run_until(run, -1.0), MS_WRONG, "time_s: found -1");
  ENDS(ms_run_do(run, "sett X", 0.0), MS_WRONG, "event: found sett X, expected one of set, ");
  ENDS(ms_run_do(NULL, "run", 0.0), MS_NULL, "run: found NULL");
  ENDS(ms_run_fault(run, NULL, 9, NULL), MS_NULL, "text: found NULL");
  ENDS(ms_run_trace(run, NULL, &count), MS_NULL, "rows: found NULL");
  ENDS(ms_run_failed(NULL, &number), MS_NULL, "run: found NULL");
  ENDS(ms_run_chip(run, NULL), MS_NULL, "copy: found NULL");
  ms_run_free(run);
  ms_run_free(NULL);
  ms_chip_free(chip);
  run = NULL;
  ENDS(ms_run_new("head PH-A\n1 sett SETPOINT 60", &run), MS_WRONG, "scenario, line 2: found sett SETPOINT 60");
  ENDS(ms_run_new(NULL, &run), MS_NULL, "scenario: found NULL");
  CHECK(run == NULL);
}

static void profile(void) {
  ms_limits limits = ms_default_limits();
  const ms_motion_state state = {5.0, 30.0, 100.0, 0.0}, end = {50.0, 10.0, 20.0, 0.0};
  ms_motion_state states[3];
  double times[3] = {0.0, 0.0, 0.0}, duration = 0.0;
  ms_profile *profile = NULL;
  GOOD(ms_profile_scurve(&limits, 50.0, 0.0, 0.0, &profile));
  GOOD(ms_profile_duration(profile, &duration));
  times[1] = duration / 2.0;
  times[2] = duration;
  GOOD(ms_profile_sample(profile, times, 3, states));
  CHECK(states[0].position_mm == 0.0 && fabs(states[1].position_mm - 25.0) < 1e-9 && fabs(states[2].position_mm - 50.0) < 1e-9);
  GOOD(ms_profile_sample(profile, NULL, 0, NULL));
  times[1] = INFINITY;
  ENDS(ms_profile_sample(profile, times, 3, states), MS_WRONG, "times_s: found inf");
  ENDS(ms_profile_sample(profile, times, 3, NULL), MS_NULL, "states: found NULL");
  ENDS(ms_profile_duration(NULL, &duration), MS_NULL, "profile: found NULL");
  ms_profile_free(profile);
  GOOD(ms_profile_to_state(&limits, &state, &end, &profile));
  GOOD(ms_profile_duration(profile, &times[2]));
  GOOD(ms_profile_sample(profile, &times[2], 1, states));
  CHECK(fabs(states[0].position_mm - 50.0) < 1e-6 && fabs(states[0].velocity_mm_s - 10.0) < 1e-6);
  ms_profile_free(profile);
  GOOD(ms_profile_arrival(&limits, &state, 50.0, 10.0, 2.0, &profile));
  GOOD(ms_profile_duration(profile, &duration));
  CHECK(fabs(duration - 2.0) < 1e-9);
  times[0] = 0.0;
  GOOD(ms_profile_sample(profile, times, 1, states));
  CHECK(fabs(states[0].position_mm - 5.0) < 1e-9);
  ms_profile_free(profile);
  ms_profile_free(NULL);
  profile = NULL;
  ENDS(ms_profile_arrival(&limits, &state, 500.0, 0.0, 0.01, &profile), MS_WRONG, "expected");
  ENDS(ms_profile_scurve(NULL, 1.0, 0.0, 0.0, &profile), MS_NULL, "limits: found NULL");
  ENDS(ms_profile_to_state(&limits, &state, NULL, &profile), MS_NULL, "end: found NULL");
  limits.jerk3_mm_s3 = NAN;
  ENDS(ms_profile_scurve(&limits, 1.0, 0.0, 0.0, &profile), MS_WRONG, "expected");
  CHECK(profile == NULL);
}

static void tour(void) {
  const double points[] = {0.0, 0.0, 10.0, 0.0, 1.0, 0.0, 9.0, 0.0}, start[] = {0.0, 0.0}, broken[] = {0.0, NAN};
  const size_t *order = NULL;
  size_t count = 0;
  double before = 0.0, planned = 0.0, bound = 0.0;
  ms_tour *tour = NULL;
  GOOD(ms_tour_plan(points, 4, MS_MANHATTAN, 0, start, NULL, &tour));
  GOOD(ms_tour_order(tour, &order, &count));
  CHECK(count == 4 && order[0] == 0 && order[1] == 2 && order[2] == 3 && order[3] == 1);
  GOOD(ms_tour_length(tour, &before, &planned, &bound));
  CHECK(before == 27.0 && planned == 10.0 && bound == 10.0);
  GOOD(ms_tour_length(tour, NULL, NULL, NULL));
  ENDS(ms_tour_order(tour, NULL, &count), MS_NULL, "order: found NULL");
  ENDS(ms_tour_length(NULL, &before, NULL, NULL), MS_NULL, "tour: found NULL");
  ms_tour_free(tour);
  ms_tour_free(NULL);
  tour = NULL;
  ENDS(ms_tour_plan(broken, 1, MS_EUCLIDEAN, 1, NULL, NULL, &tour), MS_WRONG, "expected");
  ENDS(ms_tour_plan(NULL, 4, MS_CHEBYSHEV, 0, NULL, NULL, &tour), MS_NULL, "points_mm: found NULL");
  ENDS(ms_tour_plan(points, SIZE_MAX, MS_CHEBYSHEV, 0, NULL, NULL, &tour), MS_WRONG, "expected 2000000 at most");
  ENDS(ms_tour_plan(points, 4, (ms_metric)9, 0, NULL, NULL, &tour), MS_WRONG, "metric: found 9");
  CHECK(tour == NULL);
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  CHECK(strlen(ms_version()) >= 5);
  CHECK(ms_last_error()[0] == '\0');
  chip();
  run(argv[1]);
  profile();
  tour();
  return failures == 0 ? 0 : 1;
}
