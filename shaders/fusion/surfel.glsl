// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A surfel lies in three buffers of 16 bytes each:
//   position_radius  xyz in the frame of its anchor, su; radius, su
//   normal_weight    unit normal in that frame; weight = information on depth, 1/su^2; 0: removed
//   history          x  colour, 10 bits each of red, green, blue, red lowest; kCoarseMatch: of
//                       those that no depth map matched in full, one did on a coarser level
//                    y  depth maps that confirm it (low 16 bits); confidence against it: of those
//                       that see through it, in 1/8 (next 8), that see it hidden, in 1/255 (last 8)
//                    z  first (low) and last (high) depth map that saw it
//                    w  depth map to which it is anchored (low), sum of confidences * 256 (high)
// The host's view of the same is libmono3d/src/fusion/surfel.h.

const uint kMax16 = 0xFFFFu;

uint Pack16(uint low, uint high) { return min(low, kMax16) | (min(high, kMax16) << 16); }
uint Low16(uint packed) { return packed & kMax16; }
uint High16(uint packed) { return packed >> 16; }

// Colours of 8 bits, as images have them, in four more fractional steps each.
uint Colour10From8(uint rgb8) {
  const uvec3 c = uvec3(rgb8 & 0xFFu, (rgb8 >> 8) & 0xFFu, (rgb8 >> 16) & 0xFFu) * 4u;
  return c.x | (c.y << 10) | (c.z << 20);
}
// Of a pixel it is in the bit above its colour, 0xBBGGRR.
const uint kCoarseMatch = 1u << 30;
uint CoarseMatchOfPixel(uint rgb8) { return (rgb8 << 6) & kCoarseMatch; }
uint CoarseMatchOf(uint rgb10) { return rgb10 & kCoarseMatch; }

vec3 UnpackColour(uint rgb10) {
  return vec3(float(rgb10 & 0x3FFu), float((rgb10 >> 10) & 0x3FFu), float((rgb10 >> 20) & 0x3FFu));
}
uint PackColour(vec3 c) {
  const uvec3 rounded = uvec3(clamp(c, 0.0, 1023.0) + 0.5);
  return rounded.x | (rounded.y << 10) | (rounded.z << 20);
}

// What speaks against a surfel, in 1/256 like the sum of confidences that speaks for it.
uint SeenThroughAgainst(uint counts) { return ((counts >> 16) & 0xFFu) * 32u; }
uint HiddenAgainst(uint counts) { return (counts >> 24) + (counts >> 31); }

uint ConfidenceSteps(float confidence) { return uint(confidence * 256.0 + 0.5); }
