#pragma once

#include "config/section.hpp"
#include "core/keys.hpp"

namespace hueline::config {

/// Reads the keys of a group from a mapping into their members. Keys that are absent leave their members unchanged. The
/// same mapping may hold keys of other groups, so call Section::finish() when all groups have been read. Throws
/// ConfigError as Section does; an error that the group's own check finds is reported at the key that the check names.
void read_keys(Section& section, const KeyGroup& group);

/// Does the same for a Config whose keys are all the keys of the mapping: unknown keys are refused.
template <class T>
T read_config(Section section) {
  T out;
  KeyGroup group = group_of(out);
  read_keys(section, {group.visit, [&section, &group] {
                        section.finish();
                        return group.check();
                      }});
  return out;
}

}  // namespace hueline::config
