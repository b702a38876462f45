#include "drivers/guest/slot_memory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "drivers/guest/protocol.hpp"

namespace hueline::drivers::guest {
namespace {

// Slots are multiples of a page, so that each one can be mapped and protected by itself.
constexpr std::uint64_t kSlotStep = 4096;

}  // namespace

Result<Mapping> Mapping::map(int fd, std::size_t bytes, bool is_writable) {
  void* at = ::mmap(nullptr, bytes, is_writable ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED, fd, 0);
  if (at == MAP_FAILED) return io_error(fmt::format("map {} MB of shared memory", bytes >> 20), errno);
  Mapping mapping;
  mapping.bytes_ = {static_cast<std::byte*>(at), bytes};
  return mapping;
}

Mapping::~Mapping() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

SlotMemory::SlotMemory(FileDescriptor file, Mapping mapping, std::uint64_t slot_bytes, std::size_t slots)
    : file_(std::move(file)),
      mapping_(std::move(mapping)),
      slot_bytes_(slot_bytes),
      slots_(slots),
      states_(slots, State::Guest) {
  returned_.reserve(slots);
}

Result<std::shared_ptr<SlotMemory>> SlotMemory::create(std::uint64_t packet_bytes, std::size_t slots) {
  if (packet_bytes == 0 || packet_bytes > kMostPacketBytes || slots == 0 || slots > kMostSlots)
    return Error{ErrorCode::Invalid, fmt::format("{} packets of {} bytes: at most {} of {} MB", slots, packet_bytes,
                                                 kMostSlots, kMostPacketBytes >> 20)};
  const std::uint64_t slot_bytes = (packet_bytes + kSlotStep - 1) / kSlotStep * kSlotStep;
  FileDescriptor file(::memfd_create("hueline-packets", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file) return io_error("make shared memory", errno);
  if (::ftruncate(file.get(), static_cast<off_t>(slot_bytes * slots)) != 0)
    return io_error("size the shared memory", errno);
  if (::fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return io_error("seal the shared memory", errno);
  auto mapping = Mapping::map(file.get(), slot_bytes * slots, false);
  if (!mapping) return mapping.error();
  return std::shared_ptr<SlotMemory>(new SlotMemory(std::move(file), std::move(mapping).value(), slot_bytes, slots));
}

std::vector<std::uint32_t> SlotMemory::hand_over() {
  Lock lock(mutex_);
  returned_.clear();
  std::vector<std::uint32_t> free;
  for (std::uint32_t slot = 0; slot < states_.size(); ++slot) {
    if (states_[slot] == State::Lent) continue;
    states_[slot] = State::Guest;
    free.push_back(slot);
  }
  return free;
}

std::vector<std::uint32_t> SlotMemory::take_returned() {
  Lock lock(mutex_);
  std::vector<std::uint32_t> taken(returned_);
  returned_.clear();  // keeps its reserved memory
  for (const std::uint32_t slot : taken) states_[slot] = State::Guest;
  return taken;
}

Buffer SlotMemory::lend(std::uint32_t slot, std::uint64_t bytes) {
  {
    Lock lock(mutex_);
    if (slot >= states_.size() || states_[slot] != State::Guest || bytes == 0 || bytes > slot_bytes_) return {};
    states_[slot] = State::Lent;
  }
  return Buffer::lent(shared_from_this(), mapping_.bytes().subspan(slot * slot_bytes_, bytes));
}

void SlotMemory::give_back(const std::byte* data) noexcept {
  const auto slot =
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(data - mapping_.bytes().data()) / slot_bytes_);
  Lock lock(mutex_);
  states_[slot] = State::Returned;
  returned_.push_back(slot);
}

}  // namespace hueline::drivers::guest
