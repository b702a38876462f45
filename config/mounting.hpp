#pragma once

#include <string>

#include "config/section.hpp"
#include "core/frames.hpp"

namespace hueline::config {

/// A rigid transform in YAML: `position_m: [x, y, z]` and one of
///   rotation_deg: [a, b, c]        R = Rz(c) Ry(b) Rx(a): about the fixed axes x, then y, then z
///   rotation_matrix: [9 numbers]   rows, orthonormal within 1e-6
///   quaternion_wxyz: [w, x, y, z]  normalised on reading
/// and, if it was calibrated, `calibration`: the record of that.
struct Mounting {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d position_m;
};
Mounting read_mounting(Section section);

/// T_to_from out of the mapping `key`, named as in code: T_body_scanner, T_body_head, T_head_lens.
template <class To, class From>
Transform<To, From> read_transform(Section& parent, const std::string& key) {
  const Mounting m = read_mounting(parent.section(key));
  return {m.rotation, m.position_m};
}

}  // namespace hueline::config
