// SPDX-License-Identifier: Apache-2.0
// The peer of `meltstage bench conformal`: SISL's cubic interpolation (s1356) of the points in a file, in a
// process of its own, since SISL is under the AGPL and the command isn't.
//   sisl_interpolation POINTS ROUNDS    POINTS: doubles x y z, binary
// Prints the processor time of the best round in microseconds and the largest error in millimetres.
#include <sisl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <vector>

namespace {

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::ifstream file(argv[1], std::ios::binary | std::ios::ate);
  std::vector<double> points(static_cast<std::size_t>(std::max<std::streamoff>(file.tellg(), 0)) /
                             sizeof(double));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(double)));
  const int count = static_cast<int>(points.size() / 3), rounds = std::atoi(argv[2]);
  if (!file || count < 4) return 2;
  std::vector<int> kinds(static_cast<std::size_t>(count), 1);  // every point is to be met
  double best_s = std::numeric_limits<double>::infinity(), error_mm = 0.0;
  for (int round = 0; round < rounds; ++round) {
    SISLCurve* curve = nullptr;
    double* parameters = nullptr;
    double end = 0.0;
    int parameter_count = 0, status = 0;
    const double start_s = processor_s();
    // Natural ends (0), open, order 4: chord-length parameters from 0.
    s1356(points.data(), count, 3, kinds.data(), 0, 0, 1, 4, 0.0, &end, &curve, &parameters, &parameter_count,
          &status);
    best_s = std::min(best_s, processor_s() - start_s);
    if (status < 0) return 1;
    if (round == 0) {
      int span = 0;
      for (int i = 0; i < std::min(count, parameter_count); ++i) {
        double at[3];
        s1227(curve, 0, parameters[i], &span, at, &status);
        const double* p = points.data() + 3 * i;
        error_mm = std::max(error_mm, std::hypot(at[0] - p[0], at[1] - p[1], at[2] - p[2]));
      }
    }
    freeCurve(curve);
    std::free(parameters);
  }
  std::printf("%.17g %.17g\n", best_s * 1e6, error_mm);
  return 0;
}
