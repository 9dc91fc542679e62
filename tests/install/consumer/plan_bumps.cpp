// SPDX-License-Identifier: Apache-2.0
// Reads a coordinate file, plans the path and makes the first move: every header of the installed library.
#include <meltstage/motion/bumps/coordinates.hpp>
#include <meltstage/motion/profile/profile.hpp>
#include <meltstage/motion/profile/pulse_train.hpp>
#include <meltstage/motion/profile/retarget.hpp>
#include <meltstage/motion/profile/shaping.hpp>
#include <meltstage/motion/profile/vibration.hpp>
#include <meltstage/motion/stage/accuracy.hpp>
#include <meltstage/motion/stage/axis.hpp>
#include <meltstage/motion/stage/droplet_camera.hpp>
#include <meltstage/motion/stage/droplet_vision.hpp>
#include <meltstage/motion/stage/gcode.hpp>
#include <meltstage/motion/stage/jetting.hpp>
#include <meltstage/motion/stage/stage.hpp>
#include <meltstage/motion/stage/stage_model.hpp>
#include <meltstage/motion/tour/ants.hpp>
#include <meltstage/motion/tour/path.hpp>

int main(int argc, char** argv) {
  using namespace meltstage::motion;
  if (argc != 2) return 2;
  const std::vector<Point> points = read_coordinates(argv[1]);
  const Plan plan = plan_path(points, Metric::manhattan, {});
  const Point& first = points[plan.order.front()];
  Stage stage{StageConfig{}};
  const std::uint64_t end = stage.move_to({first.x_mm, first.y_mm, 0.0}, 0);
  stage.run_until(end, [](const StageEvent&) {});
  const bool arrived = (stage.position_mm() - Eigen::Vector3d(first.x_mm, first.y_mm, 0.0)).norm() < 1e-3;
  const JerkProfile quiet =
      plan_quiet_move(asymmetric_limits(400, 4000, 4000, 1e6, 1e6), 20.0, {{38.0, 0.05}, 0.1}, 0.01);
  if (settling_s(residual_mm(quiet, {38.0, 0.05}), {38.0, 0.05}, 0.01) != 0.0) return 1;
  const FlyByPlan rows = plan_fly_by(points, {});
  AxisControl control{{}};
  control.set_homed(0.0);
  const bool fires = !rows.rows.front().triggers.empty() && control.homed();
  const TargetDeviations low{10.0, {1.0, 1.2}, {3.0, 3.1}}, high{90.0, {2.0, 2.1}, {4.0, 4.2}};
  const std::vector<TargetDeviations> test = {low, high};
  const CompensationTable table = make_compensation(evaluate_accuracy(test));
  GcodeOptions machine;
  const std::string program = write_gcode(points, {0.0, 0.0}, "bumps", machine);
  if (!fires || compensated_forward_mm(table, 50.0) >= 50.0 || program.empty()) return 1;
  if (plan_path_by_ants(points, Tour::open).cost_after < plan_path(points).lower_bound) return 1;
  return arrived && plan.cost_after < plan.cost_before ? 0 : 1;
}
