#include "products/laz_file.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>

namespace hueline::products {

using storage::Bytes;

Result<LazFile> LazFile::create(const std::filesystem::path& path, const storage::LasHeader& header,
                                const std::vector<storage::LasVlr>& records, std::uint32_t chunk_points, int threads) {
  const storage::LazRecord kind{header.point_format, header.point_size};
  if (!storage::is_laz_record(kind))
    return Error{ErrorCode::Invalid, "point format " + std::to_string(kind.format) +
                                         " cannot be written as LAZ: formats " + storage::kLazFormats + " can"};
  auto file = storage::FileWriter::replace(path);
  if (!file) return file.error();
  LazFile out(std::move(*file));
  out.kind_ = kind;
  out.has_points_ = chunk_points == storage::kLazVariableChunks;
  out.threads_ = static_cast<std::size_t>(threads);
  Bytes vlrs;
  for (const storage::LasVlr& record : records) storage::append_vlr(vlrs, record);
  storage::append_vlr(vlrs, storage::laz_vlr(kind, chunk_points));
  out.header_ = header;
  out.header_.version_minor = 4;
  out.header_.evlr_offset = 0;
  out.header_.evlr_count = 0;
  out.header_.point_count = 0;
  out.header_.points_by_return = {};
  out.header_.minimum = out.header_.maximum = {};
  out.header_.point_format |= storage::kLazFlag;
  out.header_.header_size = storage::kLasHeaderSize14;
  out.header_.vlr_count = static_cast<std::uint32_t>(records.size() + 1);
  out.header_.point_offset = static_cast<std::uint32_t>(storage::kLasHeaderSize14 + vlrs.size());
  storage::append(vlrs, std::uint64_t{out.header_.point_offset});  // that is: there is no table yet
  const Bytes head = storage::encode_las_header(out.header_);
  const storage::ByteView pieces[] = {head, vlrs};
  if (Status written = out.file_.write(pieces); !written) return written.error();
  return out;
}

void LazFile::count(const storage::LasPoint& point) {
  const std::array<double, 3> place{point.x, point.y, point.z};
  if (header_.point_count++ == 0) header_.minimum = header_.maximum = place;
  for (std::size_t i = 0; i < place.size(); ++i) {
    header_.minimum[i] = std::min(header_.minimum[i], place[i]);
    header_.maximum[i] = std::max(header_.maximum[i], place[i]);
  }
  if (point.return_number >= 1) ++header_.points_by_return[point.return_number - 1u];
}

Status LazFile::add(Bytes records) {
  while (waiting_.size() >= threads_)
    if (Status written = write_oldest(); !written) return written;
  const auto points = static_cast<std::uint32_t>(records.size() / kind_.size);
  // Where no thread can be had, the chunk is compressed when it is written.
  const auto where = threads_ == 1 ? std::launch::deferred : std::launch::async | std::launch::deferred;
  waiting_.push_back({std::async(where, [records = std::move(records),
                                         kind = kind_] { return storage::encode_laz_chunk(records, kind); }),
                      points});
  return {};
}

Status LazFile::write_oldest() {
  Waiting chunk = std::move(waiting_.front());
  waiting_.pop_front();
  const Bytes bytes = chunk.bytes.get();
  const std::uint64_t offset = file_.size();
  if (Status written = file_.write(bytes); !written) return written;
  places_.push_back({offset, {bytes.size(), chunk.points}});
  return {};
}

Status LazFile::end_chunks() {
  while (!waiting_.empty())
    if (Status written = write_oldest(); !written) return written;
  std::vector<storage::LazChunkSize> table;
  for (const storage::LazPlace& place : places_) table.push_back(place.size);
  const std::uint64_t offset = file_.size();
  if (Status written = file_.write(storage::encode_laz_table(table, has_points_)); !written) return written;
  return file_.overwrite(header_.point_offset, std::as_bytes(std::span(&offset, 1)));
}

Status LazFile::close() {
  if (Status written = file_.overwrite(0, storage::encode_las_header(header_)); !written) return written;
  return file_.close();
}

std::vector<storage::LasVlr> lasting_records(const std::vector<storage::LasVlr>& records) {
  std::vector<storage::LasVlr> out;
  for (const storage::LasVlr& record : records)
    if (record.user_id != "laszip encoded" && record.user_id != "copc" && record.user_id != "hueline")
      out.push_back(record);
  return out;
}

}  // namespace hueline::products
