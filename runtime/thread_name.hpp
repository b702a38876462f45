#pragma once

#include <pthread.h>

#include <string>

namespace hueline::runtime {

/// Gives the calling thread the name that `top -H` shows. 15 characters are kept.
inline void name_this_thread(const std::string& name) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
}

}  // namespace hueline::runtime
