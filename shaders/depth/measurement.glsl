// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A measurement of photometric.comp in two words: the inverse depth before the step, and in fields
//   31..20  the step, -1 to 1 plane, in 1/2047;
//   19..12  the mean weight of the sources, 0 to 1, in 1/255;
//   11..0   the information, 1 to 2^32, to 0.4 %: exponent and mantissa of a float, cut short.
// Both words are 0 where there is no estimate. Rows have an even number of measurements, so that a
// texel holds two. Host side: depth/measurement.h.
const int kMeasurementBorder = 3;

int MeasurementsPerRow(uint width_px) {
  return (int(width_px) + 2 * kMeasurementBorder + 1) & ~1;
}

uvec2 PackMeasurement(float inverse_depth, float step, float information, float support) {
  const uint exponent_and_mantissa =
      (floatBitsToUint(clamp(information, 1.0, 4e9)) - 0x3f800000u + 0x8000u) >> 16;
  return uvec2(floatBitsToUint(inverse_depth), (uint(int(round(2047.0 * step))) << 20) |
                                                   (uint(255.0 * support + 0.5) << 12) |
                                                   exponent_and_mantissa);
}

float StepOf(uint fields) { return float(int(fields) >> 20) / 2047.0; }
float SupportOf(uint fields) { return float((fields >> 12) & 0xffu) / 255.0; }
// 1 where there is no estimate.
float InformationOf(uint fields) { return uintBitsToFloat(((fields & 0xfffu) << 16) + 0x3f800000u); }
