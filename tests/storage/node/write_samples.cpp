// Writes recordings and a cloud, and beside them as JSON what is in them, taken from the data that were written, not
// from the files:
//   write_storage_samples FOLDER
#include <algorithm>
#include <cstdio>
#include <fstream>

#include "core/standard_streams.hpp"
#include "products/cloud_export.hpp"
#include "products/cloud_split.hpp"
#include "storage/crc32.hpp"
#include "storage/journal_writer.hpp"
#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "storage/part_index.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/storage/sample_view.hpp"

namespace {

using namespace hueline;
using namespace hueline::storage;

bool failed(const Status& status) {
  if (!status) std::fprintf(stderr, "%s\n", status.error().message.c_str());
  return !status;
}

bool write_recordings(const std::filesystem::path& folder) {
  const auto packets = test::sample_packets(500);
  for (const Compression compression : {Compression::None, Compression::Lz4, Compression::Zstd}) {
    JournalWriter::Config config;
    config.compression = compression;
    config.chunk_bytes = 128 * 1024;
    config.if_exists = IfExists::Replace;
    const std::string kind = compression == Compression::None ? "none" : mcap_name(compression);
    auto writer = JournalWriter::create(folder / ("raw_" + kind + ".mcap"), test::sample_header(), config);
    if (!writer) return !failed(writer.error());
    for (const Packet& p : packets)
      if (failed(writer->append(p, test::time_of(p)))) return false;
    if (failed(writer->close())) return false;
  }
  std::ofstream json(folder / "raw.json");
  json << "[";
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const Packet& p = packets[i];
    json << (i ? ",\n" : "\n") << "{\"topic\":\"" << raw_topic(test::sample_header().sensors[p.sensor].name)
         << "\",\"sequence\":\"" << p.sequence << "\",\"received_ns\":\"" << count_ns(p.received)
         << "\",\"kind\":" << static_cast<int>(p.kind) << ",\"shed\":" << (p.shed ? "true" : "false")
         << ",\"sensor\":" << p.sensor << ",\"size\":" << p.bytes.size() << ",\"crc\":" << crc32(0, p.bytes.bytes())
         << "}";
  }
  json << "\n]\n";
  return json.good();
}

/// Writes the cloud as LAZ: in one piece, and as a program does that may be killed.
bool write_laz(const std::filesystem::path& folder, const CloudBlock& cloud, LasWriter::Config config) {
  config.format = CloudFormat::Laz;
  for (const char* name : {"cloud.laz", "cloud_live.laz"}) {
    config.header_every = name == std::string_view("cloud.laz") ? LasWriter::Config::kOnlyAtTheEnd : 50'000;
    auto writer = LasWriter::create(folder / name, cloud.origin, config);
    if (!writer) return !failed(writer.error());
    if (failed(writer->append(cloud)) || failed(writer->close())) return false;
  }
  return true;
}

/// Writes cloud.las with each point in the older format 3, and that as LAZ.
bool write_old_laz(const std::filesystem::path& folder) {
  auto cloud = LasReader::open(folder / "cloud.las");
  if (!cloud) return !failed(cloud.error());
  constexpr std::size_t kSize = 34 + 2;
  LasHeader header = cloud->header();
  header.point_format = 3;
  header.point_size = kSize;
  header.header_size = header.point_offset = kLasHeaderSize14;
  header.vlr_count = 0;
  Bytes bytes = encode_las_header(header);
  std::vector<LasPoint> points;
  while (cloud->next(points) && !points.empty())
    for (const LasPoint& p : points) {
      Bytes record(kSize);
      std::copy_n(p.record.begin(), 14, record.begin());  // the place and the intensity
      put(record, 14, static_cast<std::uint8_t>(p.return_number | p.return_count << 3));
      put(record, 15, p.classification);
      put(record, 16, static_cast<std::int8_t>(static_cast<std::int64_t>(p.x) % 90));
      put(record, 18, p.source);
      put(record, 20, *p.time);
      put(record, 28, p.red), put(record, 30, p.green), put(record, 32, p.blue);
      std::copy_n(p.record.begin() + 36, 2, record.begin() + 34);
      append(bytes, record);
    }
  std::ofstream out(folder / "old.las", std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  const auto written = products::export_laz(folder / "old.las", folder / "old.laz", {});
  return out.good() && (written ? true : !failed(written.error()));
}

/// Writes the cloud as COPC with small nodes: cloud.las made anew, and as the points come, with little memory.
bool write_copc(const std::filesystem::path& folder, const CloudBlock& cloud, LasWriter::Config config) {
  products::CloudExport again;
  again.node_points = 200;
  const auto written = products::export_copc(folder / "cloud.las", folder / "cloud.copc.laz", again);
  if (!written) return !failed(written.error());
  config.format = CloudFormat::Copc;
  config.node_points = 200;
  config.octree_bytes = 1u << 20;
  config.threads = 2;
  auto writer = LasWriter::create(folder / "cloud_live.copc.laz", cloud.origin, config);
  if (!writer) return !failed(writer.error());
  return !failed(writer->append(cloud)) && !failed(writer->close());
}

/// Writes cloud.las as tiles.
bool write_parts(const std::filesystem::path& folder) {
  const std::filesystem::path parts = folder / "parts";
  std::error_code error;
  std::filesystem::remove_all(parts, error);
  std::filesystem::create_directory(parts, error);
  const auto written =
      products::split_cloud(folder / "cloud.las", parts, *storage::CloudSplit::parse("tile:50m"), {}, false, {});
  if (!written) return !failed(written.error());
  const auto cloud = LasReader::open(folder / "cloud.las");
  if (!cloud) return !failed(cloud.error());
  const auto indexed = storage::write_part_index(parts / "index.geojson", written->parts, cloud->wkt());
  return indexed ? *indexed == 0 : !failed(indexed.error());
}

bool write_cloud(const std::filesystem::path& folder) {
  const CloudBlock cloud = test::sample_cloud(60'000);
  LasWriter::Config config;
  config.created = {2026, 3, 1, 12, 0, 0, 0};
  if (!write_laz(folder, cloud, config)) return false;
  auto writer = LasWriter::create(folder / "cloud.las", cloud.origin, config);
  if (!writer) return !failed(writer.error());
  if (failed(writer->append(cloud)) || failed(writer->close()) || !write_copc(folder, cloud, config) ||
      !write_old_laz(folder) || !write_parts(folder) ||
      !products::export_ply(folder / "cloud.las", folder / "cloud.ply") ||
      !products::export_e57(folder / "cloud.las", folder / "cloud.e57", "hueline"))
    return false;
  std::ofstream json(folder / "cloud.json");
  json.precision(17);
  json << "[";
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const ColouredPoint& p = cloud.points[i];
    const Eigen::Vector3d xyz = writer->projection().project_exactly(p.east, p.north, p.up);
    json << (i ? ",\n" : "\n") << "{\"X\":" << xyz.x() << ",\"Y\":" << xyz.y() << ",\"Z\":" << xyz.z()
         << ",\"GpsTime\":" << static_cast<double>(count_ns(p.time) - 1'000'000'000'000'000'000ll) * 1e-9
         << ",\"Red\":" << p.red * 257 << ",\"Green\":" << p.green * 257 << ",\"Blue\":" << p.blue * 257
         << ",\"Intensity\":" << p.reflectivity * 257 << ",\"ReturnNumber\":" << int{p.return_number}
         << ",\"NumberOfReturns\":" << int{p.return_count} << ",\"PointSourceId\":" << p.sensor;
    for_each_field<kPointFields>([&](auto field) {
      if (field.entry.las.is_extra) json << ",\"" << field.entry.las.name << "\":" << +field.number(p);
    });
    json << "}";
  }
  json << "\n]\n";
  return json.good();
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  if (argc != 2) return std::fprintf(stderr, "write_storage_samples FOLDER\n"), 2;
  const std::filesystem::path folder = argv[1];
  std::error_code error;
  for (const char* kind : {"none", "lz4", "zstd"})
    std::filesystem::remove(folder / ("raw_" + std::string(kind) + ".mcap"), error);
  std::filesystem::create_directories(folder, error);
  return write_recordings(folder) && write_cloud(folder) && !failed(test::write_sample_view(folder / "view.mcap")) ? 0
                                                                                                                   : 1;
}
