#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "products/cloud_export.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {
namespace {

struct Options {
  std::string drive, out;
  std::string profile = "laz";
  int threads = 2;
};

/// Returns the cloud of a drive's folder, or the path itself.
std::string cloud_of(const std::string& path) {
  return runtime::drive_file(runtime::drive_file(path, "cloud.las"), "cloud.laz");
}

int export_cloud(const Options& options) {
  products::CloudExport config;
  config.threads = options.threads;
  const std::string cloud = cloud_of(options.drive);
  const auto done = options.profile == "copc" ? products::export_copc(cloud, options.out, config)
                                              : products::export_laz(cloud, options.out, config);
  if (!done.ok()) {
    log_error(done.error().message);
    return opening_status(done.error());
  }
  std::error_code ignored;
  fmt::print("{}: {} points in {} {}, {} bytes, {:.3f} of the size of {}\n", options.out, done->points, done->nodes,
             options.profile == "copc" ? "nodes of an octree" : "chunks", done->bytes,
             static_cast<double>(done->bytes) / static_cast<double>(std::filesystem::file_size(cloud, ignored)), cloud);
  if (!done->source_was_cut) return kDone;
  log_error("{} ends before its last point: everything that is whole was written", cloud);
  return kInputUnreadable;
}

}  // namespace

void add_export(Command& all) {
  auto options = std::make_shared<Options>();
  Command command = all.command("export", "write the results of a drive in the files that other programs import");
  command.required("DRIVE", options->drive, "a drive's folder; or a cloud (.las, .laz) for the profiles laz and copc")
      .reads(options->drive);
  command.setting("--profile", options->profile, "what to write", {"laz", "copc"});
  command.required("--out", options->out, "the file to write").writes(options->out);
  command.setting("--threads", options->threads, "number of threads that compress; it does not change the file",
                  {1, 64});
  command.footer(
      "laz   the cloud as LAZ 1.4 with all its fields, extra bytes included\n"
      "copc  the same as COPC 1.0: an octree that viewers load in parts, from a disk or a web server (.copc.laz)");
  command.runs([options] { return export_cloud(*options); });
}

}  // namespace hueline::apps
