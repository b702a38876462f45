#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

/// What lies in a folder that a user named, on this computer or at an address of object storage
/// (core/remote_store.hpp).
namespace hueline {

/// Returns the names of what lies in a folder, in any order. An empty path is the present folder. Errors: Io if it is
/// no folder of this computer or may not be read; those of list_remote(). At an address a folder that does not exist is
/// empty.
Result<std::vector<std::string>> list_folder(const std::filesystem::path& folder);

/// Returns whether it is a folder. What cannot be asked is none: opening it says why.
bool is_folder(const std::filesystem::path& path);

/// Returns whether it is a folder in which `name` lies. What cannot be asked is none.
bool holds(const std::filesystem::path& folder, const std::string& name);

/// Returns the absolute path without "." and "..", and without a slash at its end; of an address itself.
std::filesystem::path absolute_name(const std::filesystem::path& path);

}  // namespace hueline
