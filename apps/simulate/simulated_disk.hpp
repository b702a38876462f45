#pragma once

#include <memory>

#include "core/result.hpp"
#include "sim/faults/faulty_disk.hpp"
#include "storage/disk.hpp"

namespace hueline::apps {

/// A simulated disk below a recording. The model decides what is accepted and what survives; the bytes are in a real
/// file. It holds one file at a time. Thread safety: one thread per object.
class SimulatedDisk final : public storage::Disk {
 public:
  /// `model` must outlive it.
  explicit SimulatedDisk(sim::FaultyDisk& model) : model_(model) {}
  int create(const std::filesystem::path& path, storage::IfExists if_exists,
             std::unique_ptr<storage::DiskFile>& file) override;

  /// Changes the file to what is found of it when the computer runs again. The file must be closed, or its writer gone.
  Status leave_remains(const std::filesystem::path& path) const;

 private:
  sim::FaultyDisk& model_;
};

}  // namespace hueline::apps
