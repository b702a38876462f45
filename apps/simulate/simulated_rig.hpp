#pragma once

#include <string>

#include "sim/scenario.hpp"

namespace hueline::apps {

/// The addresses of the emulated devices.
struct SimulatedAddresses {
  std::string address = "127.0.0.1";
  /// The address of the computer that captures, in the devices' network; empty: `address`.
  std::string capture_address;
  std::string pps_socket = "out/pps.sock";
  int data_port = 2368, position_port = 8308, pos_port = 3001;
  std::string camera_serial = "HUE-0001";
  int can_port = 20000;       ///< UDP port of a CAN gateway, used if `can_interface` is empty
  std::string can_interface;  ///< name of a CAN interface that carries the bus instead of a gateway
  const std::string& receiver() const { return capture_address.empty() ? address : capture_address; }
};

/// Returns the rig file (YAML) of a scenario's vehicle with a perfect calibration: the true mountings and lenses, and
/// masks where the vehicle itself is visible. `method` is lens or panorama. `beside` is a scenario of the same vehicle
/// whose laser is added as a second scanner, on the ports after those of the first.
std::string simulated_rig(const sim::Scenario& scenario, const SimulatedAddresses& addresses, const std::string& method,
                          const sim::Scenario* beside = nullptr);

}  // namespace hueline::apps
