#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <functional>
#include <vector>

#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/sample_cloud.hpp"

/// Writes clouds for tests and reads them back.
namespace hueline::test {

inline void write_cloud(const std::filesystem::path& path, const CloudBlock& cloud,
                        const storage::LasWriter::Config& config) {
  auto writer = storage::LasWriter::create(path, sample_origin(), config);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(writer->append(cloud));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->counts().written, cloud.points.size());
}

inline storage::Bytes bytes_of(const std::filesystem::path& path) {
  storage::Bytes bytes(std::filesystem::file_size(path));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

/// Returns the records of all points that can be read, and how the reading ended.
inline storage::Bytes records_of(const std::filesystem::path& path, Status& end, std::size_t step = 65536) {
  storage::Bytes out;
  auto reader = storage::LasReader::open(path);
  end = reader ? Status{} : Status{reader.error()};
  std::vector<storage::LasPoint> points;
  while (end) {
    end = reader->next(points, step);
    if (points.empty()) break;
    for (const storage::LasPoint& point : points) storage::append(out, point.record);
  }
  return out;
}
inline storage::Bytes records_of(const std::filesystem::path& path) {
  Status end;
  storage::Bytes records = records_of(path, end);
  EXPECT_TRUE(end) << end.error().message;
  return records;
}

/// Runs the function in a child process that ends without cleaning up, and returns its exit status.
inline int status_of_killed(const std::function<int()>& function) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(function());
  int result = 0;
  ::waitpid(child, &result, 0);
  return WIFEXITED(result) ? WEXITSTATUS(result) : -1;
}

/// Writes 600 000 points with a limit of the file's size that stops it on the way. Returns 0 if the writer says so.
inline int write_into_limit(const std::filesystem::path& path, const storage::LasWriter::Config& config) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{1'500'000, 1'500'000};
  ::setrlimit(RLIMIT_FSIZE, &limit);
  auto writer = storage::LasWriter::create(path, sample_origin(), config);
  const Status appended = writer->append(sample_cloud(600'000));
  if (appended || appended.error().code != ErrorCode::Io) return 1;
  const Status closed = writer->close();
  if (closed || closed.error().message != appended.error().message) return 2;
  if (writer->counts().written == 0 || writer->counts().lost == 0) return 3;
  return writer->header().point_count == writer->counts().written ? 0 : 4;
}

}  // namespace hueline::test
