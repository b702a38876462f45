#include "core/fault.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>

#include "core/printable.hpp"

namespace hueline {

const char* name(FaultKind kind) {
  constexpr std::array<const char*, kFaultKinds> names{
      "Disconnected", "Reconnected", "Silent",        "Overflow", "Malformed",  "Lost",
      "Late",         "ClockStep",   "LabelConflict", "Spurious", "Shed",       "DiskFull",
      "WrongSize",    "WrongDevice", "NoTime",        "Refused",  "Implausible"};
  const auto i = static_cast<std::size_t>(kind);
  return i < names.size() ? names[i] : "?";
}

// The detail may quote a device, and a recording of an older program may contain such a quotation unchanged. So the
// detail is made printable in both directions.
std::vector<std::byte> encode_fault(const Fault& fault) {
  const std::string detail = printable(fault.detail);
  std::vector<std::byte> out(9 + detail.size());
  out[0] = static_cast<std::byte>(fault.kind);
  for (int i = 0; i < 8; ++i) out[static_cast<std::size_t>(1 + i)] = static_cast<std::byte>(fault.count >> (8 * i));
  if (!detail.empty()) std::memcpy(out.data() + 9, detail.data(), detail.size());
  return out;
}

Result<Fault> decode_fault(SensorId sensor, HostTime time, std::span<const std::byte> bytes) {
  if (bytes.size() < 9)
    return Error{ErrorCode::Truncated, fmt::format("fault event of {} bytes; at least 9", bytes.size())};
  const auto kind = static_cast<std::uint8_t>(bytes[0]);
  if (kind >= kFaultKinds) return Error{ErrorCode::Unsupported, fmt::format("fault kind {} is not known", kind)};
  Fault fault{sensor, static_cast<FaultKind>(kind), time, 0, {}};
  for (int i = 0; i < 8; ++i)
    fault.count |= static_cast<std::uint64_t>(bytes[static_cast<std::size_t>(1 + i)]) << (8 * i);
  fault.detail = printable({reinterpret_cast<const char*>(bytes.data()) + 9, bytes.size() - 9});
  return fault;
}

}  // namespace hueline
