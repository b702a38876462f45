#include "drivers/guest/protocol.hpp"

#include <fmt/format.h>

#include <cstring>
#include <utility>
#include <variant>

namespace hueline::drivers::guest {
namespace {

constexpr std::size_t kMostWillBytes = 64;

enum class Kind : std::uint32_t {
  Config = 1,
  Memory,
  GiveBack,
  Stop,
  Alive = 101,
  LastWill,
  NeedMemory,
  Running,
  Done,
  Loss,
  Failed
};

class Writer {
 public:
  explicit Writer(Kind kind) { number(kind); }
  template <class T>
  Writer& number(T value) {
    return rest(std::as_bytes(std::span(&value, 1)));
  }
  Writer& rest(std::span<const std::byte> bytes) {
    out_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return *this;
  }
  Writer& text(std::string_view text) { return rest(std::as_bytes(std::span(text))); }
  std::vector<std::byte> take() const {
    const auto bytes = std::as_bytes(std::span(out_));
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::string out_;
};

/// Reads members one after the other. is_whole() returns whether the bytes were enough and nothing is left.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  T number() {
    T value{};
    if (bytes_.size() < sizeof(value)) {
      is_short_ = true;
      bytes_ = {};
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_ = bytes_.subspan(sizeof(value));
    return value;
  }
  std::span<const std::byte> rest() { return std::exchange(bytes_, {}); }
  std::string_view text() {
    const auto bytes = rest();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  bool is_whole() const { return !is_short_ && bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
  bool is_short_ = false;
};

Error malformed(std::uint32_t kind, std::string_view what) {
  return {ErrorCode::Malformed, fmt::format("message {}: {}", kind, what)};
}

template <class Message, class One>
Result<Message> whole(const Reader& reader, std::uint32_t kind, One message) {
  if (!reader.is_whole()) return malformed(kind, "wrong size");
  return Message(std::move(message));
}

}  // namespace

std::string printable(std::string_view text, std::size_t most) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.remove_suffix(1);
  if (text.size() > most) text.remove_prefix(text.size() - most);
  std::string out(text);
  for (char& c : out) {
    if (c == '\n' || c == '\t') c = ' ';
    if (c < 0x20 || c > 0x7e) c = '?';
  }
  return out;
}

std::vector<std::byte> encode(const ToGuest& message) {
  return std::visit(
      Overloaded{
          [](const Config& m) {
            return Writer(Kind::Config)
                .number(static_cast<std::uint32_t>(m.driver.size()))
                .text(m.driver)
                .text(m.text)
                .take();
          },
          [](const Memory& m) { return Writer(Kind::Memory).number(m.slot_bytes).number(m.slots).take(); },
          [](const GiveBack& m) { return Writer(Kind::GiveBack).rest(std::as_bytes(std::span(m.slots))).take(); },
          [](const Stop&) { return Writer(Kind::Stop).take(); },
      },
      message);
}

std::vector<std::byte> encode(const ToHost& message) {
  return std::visit(
      Overloaded{
          [](const Alive&) { return Writer(Kind::Alive).take(); },
          [](const LastWill& m) {
            return Writer(Kind::LastWill)
                .number(m.from)
                .number(m.to)
                .number(m.from_port)
                .number(m.to_port)
                .rest(m.datagram)
                .take();
          },
          [](const NeedMemory& m) { return Writer(Kind::NeedMemory).number(m.packet_bytes).take(); },
          [](const Running&) { return Writer(Kind::Running).take(); },
          [](const Done& m) {
            return Writer(Kind::Done)
                .number(m.slot)
                .number(m.bytes)
                .number(m.received.time_since_epoch().count())
                .take();
          },
          [](const Loss& m) {
            Fault cut = m.fault;
            if (cut.detail.size() > kMostTextBytes) cut.detail.resize(kMostTextBytes);
            return Writer(Kind::Loss).number(cut.time.time_since_epoch().count()).rest(encode_fault(cut)).take();
          },
          [](const Failed& m) {
            return Writer(Kind::Failed)
                .number(m.error.code)
                .text(std::string_view(m.error.message).substr(0, kMostTextBytes))
                .take();
          },
      },
      message);
}

Result<ToGuest> decode_for_guest(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  const auto kind = reader.number<std::uint32_t>();
  switch (static_cast<Kind>(kind)) {
    case Kind::Config: {
      const auto size = reader.number<std::uint32_t>();
      const std::string_view text = reader.text();
      if (size > text.size()) return malformed(kind, "shorter than it says");
      return whole<ToGuest>(reader, kind, Config{std::string(text.substr(0, size)), std::string(text.substr(size))});
    }
    case Kind::Memory: {
      Memory memory;
      memory.slot_bytes = reader.number<std::uint64_t>();
      memory.slots = reader.number<std::uint32_t>();
      if (memory.slots > kMostSlots || memory.slot_bytes == 0) return malformed(kind, "a number out of its range");
      return whole<ToGuest>(reader, kind, memory);
    }
    case Kind::GiveBack: {
      const auto rest = reader.rest();
      GiveBack back;
      back.slots.resize(rest.size() / sizeof(std::uint32_t));
      if (rest.size() % sizeof(std::uint32_t) != 0) return malformed(kind, "wrong size");
      if (!rest.empty()) std::memcpy(back.slots.data(), rest.data(), rest.size());
      return whole<ToGuest>(reader, kind, std::move(back));
    }
    case Kind::Stop:
      return whole<ToGuest>(reader, kind, Stop{});
    default:
      return malformed(kind, "not known");
  }
}

Result<ToHost> decode_for_host(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  const auto kind = reader.number<std::uint32_t>();
  switch (static_cast<Kind>(kind)) {
    case Kind::Alive:
      return whole<ToHost>(reader, kind, Alive{});
    case Kind::LastWill: {
      LastWill will;
      will.from = reader.number<std::array<std::uint8_t, 4>>();
      will.to = reader.number<std::array<std::uint8_t, 4>>();
      will.from_port = reader.number<std::uint16_t>();
      will.to_port = reader.number<std::uint16_t>();
      const auto rest = reader.rest();
      if (rest.size() > kMostWillBytes) return malformed(kind, "a last will of more than 64 bytes");
      will.datagram.assign(rest.begin(), rest.end());
      return whole<ToHost>(reader, kind, std::move(will));
    }
    case Kind::NeedMemory:
      return whole<ToHost>(reader, kind, NeedMemory{reader.number<std::uint64_t>()});
    case Kind::Running:
      return whole<ToHost>(reader, kind, Running{});
    case Kind::Done: {
      Done done;
      done.slot = reader.number<std::uint32_t>();
      done.bytes = reader.number<std::uint64_t>();
      done.received = HostTime(nanoseconds(reader.number<std::int64_t>()));
      return whole<ToHost>(reader, kind, done);
    }
    case Kind::Loss: {
      const HostTime time(nanoseconds(reader.number<std::int64_t>()));
      auto fault = decode_fault(kSystemSensor, time, reader.rest());
      if (!fault) return malformed(kind, fault.error().message);
      fault->detail = printable(fault->detail);
      return whole<ToHost>(reader, kind, Loss{std::move(*fault)});
    }
    case Kind::Failed: {
      const auto code = reader.number<std::uint8_t>();
      if (code > static_cast<std::uint8_t>(ErrorCode::Io)) return malformed(kind, "an error that is not known");
      return whole<ToHost>(reader, kind, Failed{{static_cast<ErrorCode>(code), printable(reader.text())}});
    }
    default:
      return malformed(kind, "not known");
  }
}

}  // namespace hueline::drivers::guest
