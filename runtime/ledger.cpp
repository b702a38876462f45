#include "runtime/ledger.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace hueline::runtime {
namespace {

constexpr std::size_t kHead = 4, kNumbers = 6, kSensorBytes = kNumbers * 8;
constexpr std::uint64_t kVersion = 1;

void put(std::vector<std::byte>& out, std::uint64_t number, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(static_cast<std::byte>(number >> (8 * i)));
}

std::uint64_t get(std::span<const std::byte> bytes) {
  std::uint64_t out = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) out = out << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return out;
}

}  // namespace

std::vector<std::byte> encode_ledger(const Ledger& ledger) {
  std::vector<std::byte> out;
  out.reserve(kHead + ledger.sensors.size() * kSensorBytes);
  put(out, kVersion, 2);
  put(out, ledger.sensors.size(), 2);
  for (const Ledger::Sensor& one : ledger.sensors)
    for (const std::uint64_t number : {one.packets, one.bytes, one.wire, one.shed, one.refused, one.refused_wire})
      put(out, number, 8);
  return out;
}

Result<Ledger> decode_ledger(std::span<const std::byte> bytes) {
  const Error malformed{ErrorCode::Malformed, fmt::format("{} bytes are no ledger", bytes.size())};
  if (bytes.size() < kHead) return malformed;
  if (const std::uint64_t version = get(bytes.first(2)); version > kVersion)
    return Error{ErrorCode::Unsupported,
                 fmt::format("a ledger of version {}; this program knows {}", version, kVersion)};
  const auto sensors = static_cast<std::size_t>(get(bytes.subspan(2, 2)));
  if (get(bytes.first(2)) != kVersion || sensors == 0 || bytes.size() != kHead + sensors * kSensorBytes)
    return malformed;
  Ledger out;
  for (std::size_t i = 0; i < sensors; ++i) {
    const auto number = [&](std::size_t n) { return get(bytes.subspan(kHead + i * kSensorBytes + n * 8, 8)); };
    out.sensors.push_back({number(0), number(1), number(2), number(3), number(4), number(5)});
  }
  return out;
}

LedgerCheck::LedgerCheck(bool begins_late) {
  if (!begins_late) last_ = Ledger();
}

LedgerCheck::Account& LedgerCheck::account(std::size_t sensor) {
  if (accounts_.size() <= sensor) accounts_.resize(sensor + 1);
  return accounts_[sensor];
}

void LedgerCheck::take(const Packet& packet) {
  if (packet.kind == PacketKind::Ledger) {
    if (const auto ledger = decode_ledger(packet.bytes.bytes()); ledger.ok())
      compare(*ledger, packet.sequence);
    else
      ++contradictions_;
  }
  if (packet.sequence > next_sequence_ && (last_ || next_sequence_ > 0))
    gaps_behind_ += packet.sequence - next_sequence_;
  next_sequence_ = packet.sequence + 1;
  if (found_.size() <= packet.sensor) found_.resize(packet.sensor + std::size_t{1});
  ++found_[packet.sensor].packets;
  found_[packet.sensor].bytes += packet.bytes.size();
  ++behind_;
  Account& here = account(packet.sensor);
  ++here.here;
  here.bytes += packet.bytes.size();
  if (packet.kind == PacketKind::Wire) ++here.wire;
  if (packet.shed) ++here.shed;
}

/// The ledger counts what came before it, and not itself.
void LedgerCheck::compare(const Ledger& ledger, std::uint64_t sequence) {
  ++ledgers_;
  behind_ = gaps_behind_ = 0;
  next_sequence_ = sequence;
  const std::vector<Ledger::Sensor> found = std::exchange(found_, {});
  const std::optional<Ledger> last = std::exchange(last_, ledger);
  std::uint64_t sum = 0;
  for (const Ledger::Sensor& one : ledger.sensors) sum += one.packets + one.refused;
  bool is_contradiction =
      sum != sequence || found.size() > ledger.sensors.size() || (last && last->sensors.size() > ledger.sensors.size());
  if (last && !is_contradiction) {
    for (std::size_t i = 0; i < ledger.sensors.size(); ++i) {
      const Ledger::Sensor now = ledger.sensors[i];
      const Ledger::Sensor before = i < last->sensors.size() ? last->sensors[i] : Ledger::Sensor();
      const Ledger::Sensor there = i < found.size() ? found[i] : Ledger::Sensor();
      if (now.packets < before.packets + there.packets || now.bytes < before.bytes || now.refused < before.refused) {
        is_contradiction = true;
        continue;
      }
      const std::uint64_t entered = now.packets - before.packets;
      account(i).missing += entered - there.packets;
      is_contradiction |= there.packets == entered && there.bytes != now.bytes - before.bytes;
    }
  }
  contradictions_ += is_contradiction;
}

void LedgerCheck::finish(std::uint64_t by_ring) {
  if (last_) accounts_.resize(std::max(accounts_.size(), last_->sensors.size()));
  for (std::size_t i = 0; i < accounts_.size(); ++i) {
    Account& one = accounts_[i];
    const Ledger::Sensor last = last_ && i < last_->sensors.size() ? last_->sensors[i] : Ledger::Sensor();
    const std::uint64_t behind = i < found_.size() ? found_[i].packets : 0;
    one.refused = last.refused;
    one.refused_wire = last.refused_wire;
    const std::uint64_t known = one.here + one.missing;
    if (ledgers_ > 0 && contradictions_ == 0 && last.packets + behind > known)
      one.removed = last.packets + behind - known;
    one.received = known + one.removed + one.refused;
  }
  if (by_ring == 0 || missing() != by_ring) return;
  for (Account& one : accounts_) one.removed += std::exchange(one.missing, 0);
}

std::uint64_t LedgerCheck::missing() const {
  return std::accumulate(accounts_.begin(), accounts_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Account& one) { return sum + one.missing; });
}

std::uint64_t LedgerCheck::removed() const {
  return std::accumulate(accounts_.begin(), accounts_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Account& one) { return sum + one.removed; });
}

}  // namespace hueline::runtime
