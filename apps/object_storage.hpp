#pragma once

#include "object_store/s3_store.hpp"

namespace hueline::apps {

/// While it lives, this program reads addresses of object storage ("s3://...") as it reads files. It tells what is
/// asked for again, and at its end how much was fetched. To be made once, in main(), before the program runs.
class ObjectStorage {
 public:
  ObjectStorage();
  ~ObjectStorage();
  ObjectStorage(const ObjectStorage&) = delete;
  ObjectStorage& operator=(const ObjectStorage&) = delete;

 private:
  object_store::S3Store store_;
};

}  // namespace hueline::apps
