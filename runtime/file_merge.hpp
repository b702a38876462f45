#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "core/decoder.hpp"
#include "core/mutex.hpp"
#include "core/packet.hpp"
#include "sync/labelled_time.hpp"

namespace hueline::runtime {

/// Merges the files that several recorders made of one drive, in the order of the times that their devices name. The
/// files' own stamps cannot order them: those of a capture file are of the computer that captured, and a receiver's log
/// has none. The order depends on the files alone, not on threads, so two readings of the same files make the same
/// journal.
///
/// The `received` of a packet becomes its device's own time, in ns since 1970-01-01 UTC. For a piece of a receiver's
/// log this is the newest time that it names. For a scanner it is the scanner's stamp, near the time that its labels
/// name. A packet that names no time follows the packet before it, at the distance of the capture file's stamps. If no
/// file names a time, the stamps of the capture files stay as they are. `received` never falls.
///
/// The sources take turns: the reader of a source must hand a packet on, and ask for the next one, before another
/// source returns its own packet.
class FileMerge {
 public:
  /// One file of the merge.
  struct Input {
    std::unique_ptr<PacketSource> source;
    std::unique_ptr<Decoder> decoder;  ///< decoder of the sensor, used only for the times that it finds
    bool has_stamps = false;           ///< the file says when its packets came
  };
  /// How far a file is searched for the labels that name its time.
  struct Config {
    int agreeing_labels = 3;
    std::size_t ahead_packets = 16384;
    std::size_t ahead_bytes = std::size_t{64} << 20;
  };

  FileMerge(std::vector<Input> inputs, Config config);
  ~FileMerge();

  /// Returns the files as sources, in the order of the inputs, each for a reader of its own. Each source is opened
  /// once, in that order. It must be closed even if it could not be opened, because the others wait for that. All
  /// sources share `merge`.
  static std::vector<std::unique_ptr<PacketSource>> sources(const std::shared_ptr<FileMerge>& merge);

  /// Returns `received` of the newest packet that was given out. Thread-safe.
  HostTime position() const;

 private:
  class Source;
  struct Ahead {
    Packet packet;
    std::optional<LaserTime> stamp;  ///< stamp of a scanner
    std::optional<GpsTime> time;     ///< time that a receiver names
  };
  struct File;

  Status open(std::size_t index);
  Result<Packet> next(std::size_t index, std::stop_token stop);
  void close(std::size_t index);
  void opened(std::size_t index) HUELINE_REQUIRES(mutex_);
  void read(File& file, std::stop_token stop);
  void look_ahead(File& file, std::stop_token stop);
  void begin() HUELINE_REQUIRES(mutex_);
  void set_key(File& file) HUELINE_REQUIRES(mutex_);
  std::optional<HostTime> own_time(const File& file, const Ahead& ahead) const;
  std::optional<std::size_t> first() const HUELINE_REQUIRES(mutex_);

  const Config config_;
  mutable Mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<std::unique_ptr<File>> files_;
  std::size_t opening_ HUELINE_GUARDED_BY(mutex_) = 0;          // the file that is next to be opened
  std::optional<std::size_t> turn_ HUELINE_GUARDED_BY(mutex_);  // the file whose packet is being handed on
  bool has_begun_ HUELINE_GUARDED_BY(mutex_) = false, is_self_timed_ HUELINE_GUARDED_BY(mutex_) = false;
  HostTime position_ HUELINE_GUARDED_BY(mutex_){};
};

}  // namespace hueline::runtime
