#include "storage/proj_context.hpp"

#include <string_view>

namespace hueline::storage {
namespace {

/// Keeps the first message about the database. PROJ gives them no number of their own.
void keep_trouble(void* trouble, int, const char* message) {
  const std::string_view text(message);
  const bool is_of_database =
      text.find("SQLite") != text.npos || text.find("proj.db") != text.npos || text.find("disk I/O") != text.npos;
  if (auto& kept = *static_cast<std::string*>(trouble); is_of_database && kept.empty()) kept = text;
}

}  // namespace

ProjContext::ProjContext() : trouble_(std::make_unique<std::string>()), context_(proj_context_create()) {
  proj_log_func(context_.get(), trouble_.get(), keep_trouble);
  proj_log_level(context_.get(), PJ_LOG_ERROR);
  proj_context_set_enable_network(context_.get(), 0);  // a grid that may be there one day and not the next
}

Status ProjContext::database() const {
  if (trouble_->empty()) return {};
  return Error{ErrorCode::Unavailable,
               "PROJ's database (package proj-data) is missing or cannot be read: " + *trouble_};
}

ProjObject horizontal_part(PJ_CONTEXT* context, const PJ* crs) {
  if (crs == nullptr) return nullptr;
  return ProjObject(proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS ? proj_crs_get_sub_crs(context, crs, 0)
                                                               : proj_clone(context, crs));
}

}  // namespace hueline::storage
