#pragma once

#include <map>
#include <string>

#include "config/rig.hpp"

namespace hueline::runtime {

/// Returns the values of a sensor's keys as text, by their names ("udp.ports"); keys without a value are not there.
std::map<std::string, std::string> values_of(const config::Sensor& sensor);

}  // namespace hueline::runtime
