#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/packet.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// A source that delivers what describes a device (a file of its maker, its metadata) before the first packet of
/// another source, as a packet that arrived with it. So the journal holds the description, and a replay needs no file.
/// Thread safety: none; one thread calls all functions.
class DescribedSource final : public PacketSource {
 public:
  /// Returns the bytes of the packet. An error ends open() with Invalid and its message.
  using Describe = std::function<Result<std::vector<std::byte>>()>;

  DescribedSource(std::unique_ptr<PacketSource> described, Describe describe)
      : described_(std::move(described)), describe_(std::move(describe)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { described_->close(); }

 private:
  std::unique_ptr<PacketSource> described_;
  Describe describe_;
  std::vector<std::byte> description_;  // until it is delivered
  std::optional<Packet> waiting_;       // the first packet, which comes behind the description
};

}  // namespace hueline::drivers
