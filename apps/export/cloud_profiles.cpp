#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "apps/exit_code.hpp"
#include "apps/export/profile.hpp"
#include "apps/log.hpp"
#include "products/cloud_export.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {
namespace {

/// Returns the cloud of a drive's folder, or the path itself.
std::string cloud_of(const std::string& path) {
  return runtime::drive_file(runtime::drive_file(path, "cloud.las"), "cloud.laz");
}

class LazProfile : public ExportProfile {
 public:
  const char* word() const override { return "laz"; }
  const char* help() const override { return "the cloud as LAZ 1.4 with all its fields, extra bytes included"; }

  int run(const ExportWords& words) override {
    products::CloudExport config;
    config.threads = words.threads;
    const std::string cloud = cloud_of(words.drive);
    const auto done = write(cloud, words.out, config);
    if (!done.ok()) {
      log_error(done.error().message);
      return opening_status(done.error());
    }
    std::error_code ignored;
    fmt::print("{}: {} points in {} {}, {} bytes, {:.3f} of the size of {}\n", words.out, done->points, done->nodes,
               parts(), done->bytes,
               static_cast<double>(done->bytes) / static_cast<double>(std::filesystem::file_size(cloud, ignored)),
               cloud);
    if (!done->source_was_cut) return kDone;
    log_error("{} ends before its last point: everything that is whole was written", cloud);
    return kInputUnreadable;
  }

 protected:
  virtual const char* parts() const { return "chunks"; }
  virtual Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                                const products::CloudExport& config) const {
    return products::export_laz(cloud, out, config);
  }
};

class CopcProfile : public LazProfile {
 public:
  const char* word() const override { return "copc"; }
  const char* help() const override {
    return "the same as COPC 1.0: an octree that viewers load in parts, from a disk or a web server (.copc.laz)";
  }

 protected:
  const char* parts() const override { return "nodes of an octree"; }
  Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                        const products::CloudExport& config) const override {
    return products::export_copc(cloud, out, config);
  }
};

}  // namespace

std::unique_ptr<ExportProfile> make_laz_profile() { return std::make_unique<LazProfile>(); }
std::unique_ptr<ExportProfile> make_copc_profile() { return std::make_unique<CopcProfile>(); }

}  // namespace hueline::apps
