#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/time.hpp"
#include "storage/cloud_split.hpp"
#include "storage/disk.hpp"
#include "storage/las_format.hpp"
#include "storage/laz_format.hpp"

namespace hueline::storage {

/// A part of a cloud.
struct CloudPart {
  std::filesystem::path file;                  ///< its name in the folder
  std::uint16_t strip = 0;                     ///< point source id of all its points; 0: it is a tile
  std::uint64_t points = 0, bytes = 0;         ///< of the file
  std::array<double, 3> minimum{}, maximum{};  ///< in the cloud's CRS
  GpsTime first{}, last{};                     ///< the first and the last firing
};

/// Writes a cloud in parts while its points come, each part as a LAZ 1.4 file with chunks of 50 000 points. Every point
/// comes into one part, in the order in which it was added. Tiles keep the records as they are. The points of a strip
/// get its number as point source id, and their scanner's number, which was there, as user data.
///
/// The drive may return to a part after any time: what does not fill a chunk is compressed when its memory is needed
/// and no point has come to the part for the longest, and that last chunk of the file is made again when points come.
/// So the bytes depend on the records alone. One file is open at a time. Each is a whole LAZ file after every chunk;
/// until finish() its name ends with ".part".
///
/// The first error is returned by all later calls of add() and by finish(): what is in the files stays readable.
/// Thread safety: none; one thread calls all functions. Threads of its own compress while it continues.
class CloudParts {
 public:
  /// More tiles are files that nobody opens, and most likely a wrong size.
  static constexpr std::size_t kMostTiles = 20'000;
  /// What is to be said when a split gives more.
  static Error too_many_tiles(const CloudSplit& split);
  struct Config {
    CloudSplit split;
    double tile_edge = 0;  ///< of CloudSplit::Kind::Tile, in the unit of the cloud's CRS
    /// Of the cloud: form of the records, scale, who made it and when. Sizes, counts and bounds are those of the parts.
    LasHeader header{};
    std::vector<LasVlr> records{};  ///< describe the points; without those of the cloud's own compression
    std::string ending = ".laz";    ///< of the names
    /// The earliest time of the cloud, from which strips are numbered. Without it, it is the earliest of the points
    /// that come in the first second, and later ones that are earlier are in the first strip.
    std::optional<GpsTime> earliest{};
    int threads = 1;                          ///< that compress; they do not change the bytes
    std::uint64_t held_bytes = 128ull << 20;  ///< memory for points that do not fill a chunk; it changes no bytes
    Disk* disk = &Disk::kernel();             ///< must outlive this object
  };

  /// `folder` must exist. Errors: Invalid if strips are asked for and the points have no GPS time, or if the records
  /// cannot be compressed.
  static Result<CloudParts> create(const std::filesystem::path& folder, Config config);
  CloudParts(CloudParts&&) noexcept = default;
  CloudParts& operator=(CloudParts&&) = delete;
  ~CloudParts() = default;

  /// Ends a strip of CloudSplit::Kind::Distance: points from `time` on are in the next one. Times do not fall. It has
  /// to be told before the points of that time come.
  void end_strip(GpsTime time) { ends_.push_back(time); }
  /// Adds whole records. Errors: Io; Invalid if there would be more than 65535 strips or kMostTiles tiles.
  Status add(ByteView records);
  /// Writes all points that wait, gives the files their names, and waits for the medium. Errors: as add().
  Status finish();

  /// The parts that finish() has written, by name.
  const std::vector<CloudPart>& parts() const { return done_; }

 private:
  /// A strip's number, or column and row of a tile.
  using Cell = std::pair<std::int64_t, std::int64_t>;
  struct CellHash {
    std::size_t operator()(const Cell& cell) const {
      return static_cast<std::size_t>(cell.first) * 0x9E3779B97F4A7C15u ^ static_cast<std::size_t>(cell.second);
    }
  };
  /// What a header says about points.
  struct Tally {
    Tally();
    std::uint64_t points = 0;
    std::array<std::uint64_t, 15> by_return{};
    std::array<double, 3> minimum{}, maximum{};
    double first_time = 0, last_time = 0;  // as stored
    void add(const Tally& other);
  };
  using Block = std::unique_ptr<std::byte[]>;
  struct Part {
    Cell cell;
    std::filesystem::path path;  // of its file; empty: there is none yet
    std::vector<Block> blocks;   // records that wait
    std::size_t waiting = 0;     // their number
    std::uint64_t last_use = 0;
    std::uint32_t tail_points = 0;  // of the last chunk if it is not full; it may still be on its way to the file
    // What is in the file: full chunks, and behind them one that is not full.
    std::vector<LazChunkSize> chunks;
    std::uint64_t whole_bytes = 0, tail_bytes = 0, bytes = 0;
    Tally whole, tail;
  };
  /// How records are to be read and packed.
  struct Form {
    LazRecord kind;
    std::array<double, 3> scale{}, offset{};
    std::size_t time_at() const { return kind.format >= 6 ? 22 : kind.format & 1 ? 20 : 0; }  // 0: they have none
    Tally tally_of(ByteView records) const;
  };
  struct Packed {
    Bytes bytes;
    Tally tally;
  };
  struct Underway {
    Part* part;
    std::future<Result<Packed>> packed;
    bool is_full;
  };

  CloudParts(std::filesystem::path folder, Config config);
  bool is_strips() const { return config_.split.is_strips(); }
  GpsTime time_of(const std::byte* record) const;
  Cell cell_of(const std::byte* record) const;
  std::int64_t strip_at(GpsTime time) const;
  std::uint16_t strip_of(const Part& part) const;
  Result<Part*> part_of(const Cell& cell);
  void put(Part& part, const std::byte* record);
  Bytes take(Part& part, std::size_t count);
  void fix_base();
  Status make_room();
  Status submit(Part& part, bool with_rest);
  Status submit_chunk(Part& part, std::size_t count);
  static Result<Packed> pack(const Form& form, const Bytes& tail, std::size_t tail_points, Bytes records);
  Status write_oldest();
  Status write_underway();
  Status write_chunk(Part& part, const Packed& packed, bool is_full);
  Result<Bytes> read_tail(const Part& part) const;
  LasHeader header_of(const Tally& tally, std::uint16_t strip) const;
  std::string name_of(const Part& part) const;
  Status name_file(Part& part);
  Status fail(Error error);

  std::filesystem::path folder_;
  Config config_;
  Form form_;
  std::size_t block_records_ = 1;
  Bytes vlrs_;  // with what stands between them and the first chunk, but for the place of the table
  std::vector<GpsTime> ends_;
  std::optional<std::int64_t> base_;          // the strip that is number 1; none: it is not known yet
  std::optional<GpsTime> earliest_, newest_;  // of the points, until it is known
  std::unordered_map<Cell, std::unique_ptr<Part>, CellHash> parts_;
  Part* latest_ = nullptr;
  std::vector<Block> free_;
  std::uint64_t used_blocks_ = 0, number_ = 0;
  std::deque<Underway> underway_;  // chunks that are being compressed
  std::vector<CloudPart> done_;
  std::optional<Error> error_;
};

/// How the name of a part ends from which an octree is made, and which is removed then.
constexpr const char* kBeforeOctree = ".part.laz";

/// What an earlier run has left in a folder of parts.
enum class EarlierParts : std::uint8_t {
  Unfinished,  ///< what a run that was killed has left: NAME.laz.part and NAME.part.laz (kBeforeOctree)
  All,         ///< these, whole parts and their index; octrees stay
};
/// Removes parts from the folder; other files stay. Returns how many files it has removed. A folder that is not there
/// is no error. Error: Io.
Result<std::size_t> remove_parts(const std::filesystem::path& folder, EarlierParts which);

}  // namespace hueline::storage
