#pragma once

#include <proj.h>

#include <memory>
#include <string>

#include "core/result.hpp"

namespace hueline::storage {

struct FreeProj {
  void operator()(PJ* p) const { proj_destroy(p); }
  void operator()(PJ_CONTEXT* p) const { proj_context_destroy(p); }
};
using ProjObject = std::unique_ptr<PJ, FreeProj>;

/// PROJ without its network and without messages, which remembers whether its database could be read. If the disk
/// refuses, PROJ only logs it and goes on with what it has read: a CRS without its area, or one operation of several.
/// Move-only. Thread safety: none.
class ProjContext {
 public:
  ProjContext();
  PJ_CONTEXT* get() const { return context_.get(); }
  /// Returns ok if everything that PROJ has asked its database so far was answered. Error: Unavailable. Ask after the
  /// objects were made, and use none of them if it is an error.
  Status database() const;

 private:
  std::unique_ptr<std::string> trouble_;  // what PROJ said of its database; PROJ has its address
  std::unique_ptr<PJ_CONTEXT, FreeProj> context_;
};

/// Returns the horizontal part of a compound CRS, and any other CRS as it is; null for null.
ProjObject horizontal_part(PJ_CONTEXT* context, const PJ* crs);

}  // namespace hueline::storage
