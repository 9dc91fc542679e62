// SPDX-License-Identifier: Apache-2.0
// Steps of a computation of ALGOR, for tc_algor and its properties; included inside the module.
// A step multiplies what it is called after, and takes the product of the step before it.
typedef enum logic [4:0] {
  StepIdle = 5'd0,
  StepAmbient = 5'd1,
  StepSetpoint = 5'd2,
  StepDutyMax = 5'd3,
  StepFeedForward = 5'd4,
  StepHoldAdd = 5'd5,
  StepHold = 5'd6,
  StepPreset = 5'd7,
  StepExternal = 5'd8,
  StepDrops = 5'd9,
  StepSlew = 5'd10,
  StepDerivative = 5'd11,
  StepProportional = 5'd12,
  StepIntegral = 5'd13,
  StepSegment = 5'd14,
  StepAntiWindup = 5'd15,
  StepClamp = 5'd16,
  StepOutput = 5'd17,
  StepLimit = 5'd18
} step_e;
