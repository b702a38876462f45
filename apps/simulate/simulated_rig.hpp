#pragma once

#include <string>

#include "sim/scenario.hpp"

namespace hueline::apps {

/// Where the emulated devices are reached.
struct SimulatedAddresses {
  std::string address = "127.0.0.1";
  std::string pps_socket = "out/pps.sock";
  int data_port = 2368, position_port = 8308, pos_port = 3001;
  std::string camera_serial = "HUE-0001";
  int can_port = 20000;       ///< of the CAN bus as a gateway's datagrams ...
  std::string can_interface;  ///< ... or the CAN interface that it is on
};

/// The rig file (YAML) of a scenario's vehicle as a perfect calibration would write it: true mounting and lenses, and
/// masks where the vehicle sees itself. `method`: lens or panorama. `beside`: a scenario of the same vehicle whose
/// laser is a second scanner, on the ports after the first one's.
std::string simulated_rig(const sim::Scenario& scenario, const SimulatedAddresses& addresses, const std::string& method,
                          const sim::Scenario* beside = nullptr);

}  // namespace hueline::apps
