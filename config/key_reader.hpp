#pragma once

#include "config/section.hpp"
#include "core/keys.hpp"

namespace hueline::config {

/// Reads the keys of a group out of a mapping: those that are there are put into the members. Other groups may have
/// keys in the same mapping; call Section::finish() when all have been read. ConfigError as Section says; what the
/// group's own check finds is told at the key that it names.
void read_keys(Section& section, const KeyGroup& group);

/// The same for a Config, all whose keys the mapping holds: unknown ones are refused.
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
