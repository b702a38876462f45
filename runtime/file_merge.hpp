#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "sync/labelled_time.hpp"

namespace hueline::runtime {

/// Files that several recorders made of one drive, given out in the order of the times that their devices name. Their
/// own stamps cannot order them: a capture's are of the computer that captured, and a receiver's log has none. The
/// order depends on the files alone, not on threads, so that two readings of the same files make the same journal.
///
/// A packet's `received` becomes its device's own time, in ns since 1970-01-01 UTC: the newest time that a piece of a
/// receiver's log names, a scanner's stamp, near the time that the scanner's labels name. What names no time follows
/// the packet before it, by the capture's stamps. Where no file names a time the captures' stamps stay as they are.
/// `received` never falls.
///
/// The sources take turns: each packet has to be handed on, by asking for the next one, before another source gives its
/// own.
class FileMerge {
 public:
  struct Input {
    std::unique_ptr<PacketSource> source;
    std::unique_ptr<Decoder> decoder;  ///< of the sensor, for its times alone
    bool has_stamps = false;           ///< the file says when its packets came
  };
  /// How far a file is looked into for the labels that name its time.
  struct Config {
    int agreeing_labels = 3;
    std::size_t ahead_packets = 16384;
    std::size_t ahead_bytes = std::size_t{64} << 20;
  };

  FileMerge(std::vector<Input> inputs, Config config);
  ~FileMerge();

  /// The files as sources, in the order of the inputs, each for a reader of its own. Each is opened once, in that
  /// order, and has to be closed also when it could not be opened: the others wait for it. All share `merge`.
  static std::vector<std::unique_ptr<PacketSource>> sources(const std::shared_ptr<FileMerge>& merge);

  /// `received` of the newest packet that was given out. Thread-safe.
  HostTime position() const;

 private:
  class Source;
  struct Ahead {
    Packet packet;
    std::optional<LaserTime> stamp;  ///< a scanner's
    std::optional<GpsTime> time;     ///< a receiver's
  };
  struct File;

  Status open(std::size_t index);
  Result<Packet> next(std::size_t index, std::stop_token stop);
  void close(std::size_t index);
  void opened(std::size_t index);
  void read(File& file, std::stop_token stop);
  void look_ahead(File& file, std::stop_token stop);
  void begin();
  void set_key(File& file);
  std::optional<HostTime> own_time(const File& file, const Ahead& ahead) const;
  std::optional<std::size_t> first() const;

  const Config config_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<std::unique_ptr<File>> files_;
  std::size_t opening_ = 0;          // the file whose turn it is to open
  std::optional<std::size_t> turn_;  // the file whose packet is being handed on
  bool has_begun_ = false, is_self_timed_ = false;
  HostTime position_{};
};

}  // namespace hueline::runtime
