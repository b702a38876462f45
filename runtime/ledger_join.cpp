#include "runtime/ledger_join.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "runtime/ingest.hpp"

namespace hueline::runtime {
namespace {

/// Returns the entry of a sensor in a list that may be shorter.
template <class T>
T at(const std::vector<T>& list, std::size_t i) {
  return i < list.size() ? list[i] : T();
}

template <class T>
T& grown(std::vector<T>& list, std::size_t i) {
  if (list.size() <= i) list.resize(i + 1);
  return list[i];
}

std::uint64_t above(std::uint64_t a, std::uint64_t b) { return a > b ? a - b : 0; }

void count(Ledger::Sensor& counts, const Packet& packet) {
  ++counts.packets;
  counts.bytes += packet.bytes.size();
  counts.wire += packet.kind == PacketKind::Wire;
  counts.shed += packet.shed;
}

}  // namespace

LedgerJoin::LedgerJoin(std::size_t sensors, std::vector<Input> inputs) {
  total_.sensors.resize(std::max<std::size_t>(sensors, 1));
  for (Input& input : inputs) {
    Part& part = parts_.emplace_back();
    part.input = std::move(input);
    if (!part.input.begins_late) part.last = Ledger();
  }
}

bool LedgerJoin::take(std::size_t input, const Packet& packet) {
  Part& part = parts_[input];
  bool is_ledger = false;
  if (packet.kind == PacketKind::Ledger) {
    if (const auto ledger = decode_ledger(packet.bytes.bytes()); ledger.ok()) {
      take_ledger(part, *ledger);
      part.next = packet.sequence;
      is_ledger = true;
    } else {
      ++part.contradictions;
    }
  }
  if (packet.sequence > part.next && (part.has_begun || !part.input.begins_late))
    part.gaps += packet.sequence - part.next;
  part.has_begun = true;
  part.next = packet.sequence + 1;
  count(grown(part.found, packet.sensor), packet);
  if (packet.kind == PacketKind::Fault)
    if (const auto fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
        fault.ok() && Ingest::is_refusal(*fault))
      grown(part.told, packet.sensor) += fault->count;
  return is_ledger;
}

void LedgerJoin::take_ledger(Part& part, const Ledger& ledger) {
  ++part.ledgers;
  const std::vector<Ledger::Sensor> found = std::exchange(part.found, {});
  const std::optional<Ledger> last = std::exchange(part.last, ledger);
  part.gaps = 0;
  part.told.clear();
  if (!last) return;
  bool is_contradiction = false;
  for (std::size_t i = 0; i < ledger.sensors.size(); ++i) {
    const Ledger::Sensor &now = ledger.sensors[i], before = at(last->sensors, i), there = at(found, i);
    if (now.packets < before.packets + there.packets || now.refused < before.refused) {
      is_contradiction = true;
      continue;
    }
    const auto becomes = at(part.input.sensors, i);
    if (!becomes) continue;
    Ledger::Sensor& total = total_.sensors[*becomes];
    total.refused += now.refused - before.refused;
    total.refused_wire += above(now.refused_wire, before.refused_wire);
    const std::uint64_t missing = now.packets - before.packets - there.packets;
    if (part.input.is_ring || missing == 0) continue;
    part.missing += missing;
    total.packets += missing;
    total.bytes += above(now.bytes - before.bytes, there.bytes);
    total.wire += std::min(missing, above(now.wire - before.wire, there.wire));
    total.shed += std::min(missing, above(now.shed - before.shed, there.shed));
  }
  part.contradictions += is_contradiction;
}

std::uint64_t LedgerJoin::keep(const Packet& packet) {
  const std::uint64_t sequence =
      std::accumulate(total_.sensors.begin(), total_.sensors.end(), gap_,
                      [](std::uint64_t sum, const Ledger::Sensor& one) { return sum + one.packets + one.refused; });
  count(total_.sensors[packet.sensor], packet);
  return sequence;
}

void LedgerJoin::finish() {
  for (const Part& part : parts_)
    for (std::size_t i = 0; i < part.told.size(); ++i)
      if (const auto becomes = at(part.input.sensors, i)) total_.sensors[*becomes].refused += part.told[i];
}

std::uint64_t LedgerJoin::unexplained(std::size_t input) const {
  const Part& part = parts_[input];
  const std::uint64_t told = std::accumulate(part.told.begin(), part.told.end(), std::uint64_t{0});
  return part.input.is_ring ? 0 : above(part.gaps, told);
}

}  // namespace hueline::runtime
