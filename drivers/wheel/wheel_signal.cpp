#include "drivers/wheel/wheel_signal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::string_view kDatabaseMagic = "DBC1";
constexpr std::size_t kNamesMost = 12;  // of an error message

template <class Named>
std::string names_of(const std::vector<Named>& all) {
  std::string out;
  for (std::size_t i = 0; i < std::min(all.size(), kNamesMost); ++i) out += (i ? ", " : "") + all[i].name;
  if (all.size() > kNamesMost) out += fmt::format(" and {} more", all.size() - kNamesMost);
  return out.empty() ? "none" : out;
}

}  // namespace

bool WheelSignal::is_in(std::span<const std::uint8_t> data) const {
  return std::ranges::all_of(selections, [&](const DbcSelection& one) { return one.holds(data); });
}

void WheelSignal::multiply(double factor) {
  for (double* value : {&scale, &offset, &min, &max}) *value *= factor;
}

Result<FoundSignal> find_signal(const Dbc& database, const WheelSignal& named) {
  const std::size_t dot = named.name.find('.');
  const std::string message_name = named.name.substr(0, dot), signal_name = named.name.substr(dot + 1);
  const auto message = std::ranges::find(database.messages, message_name, &DbcMessage::name);
  if (message == database.messages.end())
    return Error{ErrorCode::Invalid, fmt::format("{}: the database has no message {}; it has {}", named.name,
                                                 message_name, names_of(database.messages))};
  const auto signal = std::ranges::find(message->signals, signal_name, &DbcSignal::name);
  if (signal == message->signals.end())
    return Error{ErrorCode::Invalid, fmt::format("{}: the message {} has no signal {}; it has {}", named.name,
                                                 message_name, signal_name, names_of(message->signals))};
  auto conditions = selections(*message, *signal);
  if (!conditions.ok()) return conditions.error();
  FoundSignal out{&*message, signal->signal};
  out.signal.name = named.name;
  out.signal.unit = named.unit;
  out.signal.selections = std::move(*conditions);
  out.signal.multiply(named.unit);
  return out;
}

std::vector<std::byte> encode_database_packet(std::string_view text) {
  std::vector<std::byte> out;
  for (const std::string_view part : {kDatabaseMagic, text}) {
    const auto bytes = std::as_bytes(std::span(part));
    out.insert(out.end(), bytes.begin(), bytes.end());
  }
  return out;
}

std::optional<std::string_view> decode_database_packet(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(kDatabaseMagic)) return {};
  return text.substr(kDatabaseMagic.size());
}

}  // namespace hueline::drivers
