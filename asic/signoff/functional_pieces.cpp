// SPDX-License-Identifier: Apache-2.0
// The functional sign-off set: pieces directed at one requirement each, with random values where values are
// what matters. What each asks for stands in docs/make/test-vectors.md.
#include <array>

#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

Parameters calm() {
  Parameters p{};
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = spec::kHolding[i].reset;
  p[spec::kRegHostWd] = 0;
  p[spec::kRegCtrl] = kCalmCtrl;
  p[spec::kRegTs] = 20;
  p[spec::kRegTMax] = 5000;
  p[spec::kRegTMin] = -400;
  p[spec::kRegExcLimit] = 5000;
  p[spec::kRegExcTime] = 65535;
  p[spec::kRegLbaTime] = 0;
  p[spec::kRegHoldTime] = 0;
  p[spec::kRegDtdtMax] = 0;
  p[spec::kRegZeroRise] = 0;
  p[spec::kRegBadMax] = 15;
  p[spec::kRegSampleTimeout] = 65535;
  p[spec::kRegFbTime] = 65535;
  p[spec::kRegSensType] = 0;
  p[spec::kRegSensFrame] = 0x2010;
  p[spec::kRegSensData] = 16;
  p[spec::kRegSensScale] = 256;
  p[spec::kRegSensFaultMask] = 0;
  p[spec::kRegSensCheckMaskH] = 0;
  p[spec::kRegSensCheckMaskL] = 0;
  p[spec::kRegSpiDiv] = 2;
  p[spec::kRegPwmPeriod] = 3000;
  p[spec::kRegBaud] = kFastBaud;
  return p;
}

FunctionalSet functional_set(FunctionalLength length, const Progress& progress) {
  PieceState state{.quick = length == FunctionalLength::quick};
  constexpr std::array kPieces{record_start,  record_registers, record_line,       record_control,
                               record_tuning, record_pulses,    record_protection, record_long_times,
                               record_reset,  record_commits};
  for (std::size_t i = 0; i < kPieces.size(); ++i) {
    tell(progress, "recording", i, kPieces.size());
    kPieces[i](state);
  }
  return state.session.finish();
}

}  // namespace meltstage::app
