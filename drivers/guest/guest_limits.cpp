#include "drivers/guest/guest_limits.hpp"

#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/securebits.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>

namespace hueline::drivers::guest {
namespace {

constexpr std::uint32_t kUsedRights = 1u << CAP_NET_RAW | 1u << CAP_SYS_NICE;
static_assert(CAP_NET_RAW < 32 && CAP_SYS_NICE < 32);

}  // namespace

Status give_up_rights() {
  const rlimit none{0, 0};
  if (::setrlimit(RLIMIT_CORE, &none) != 0) return io_error("forbid core files", errno);
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return io_error("give up gaining rights", errno);
  // Only root may do these two. They take from root the rights that it would have by its user number.
  ::prctl(PR_SET_SECUREBITS,
          SECBIT_NOROOT | SECBIT_NOROOT_LOCKED | SECBIT_NO_SETUID_FIXUP | SECBIT_NO_SETUID_FIXUP_LOCKED, 0, 0, 0);
  for (unsigned right = 0; right <= CAP_LAST_CAP; ++right)
    if (right >= 32 || !(kUsedRights & 1u << right)) ::prctl(PR_CAPBSET_DROP, right, 0, 0, 0);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> rights{};
  if (::syscall(SYS_capget, &header, rights.data()) != 0) return io_error("read the rights of this process", errno);
  rights[0].permitted &= kUsedRights;
  rights[0].effective = rights[0].permitted;
  rights[0].inheritable = 0;
  rights[1] = {};
  if (::syscall(SYS_capset, &header, rights.data()) != 0) return io_error("give up rights", errno);
  return {};
}

Status limit_memory([[maybe_unused]] std::size_t more_bytes) {
#if !defined(HUELINE_SANITIZE_ADDRESS) && !defined(HUELINE_SANITIZE_THREAD)
  std::size_t pages = 0;
  if (!(std::ifstream("/proc/self/statm") >> pages)) return io_error("read the size of this process", errno);
  const rlim_t bytes = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + more_bytes;
  rlimit limit{};
  ::getrlimit(RLIMIT_AS, &limit);
  if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < bytes) return {};  // an outer limit is tighter
  limit.rlim_cur = bytes;
  if (::setrlimit(RLIMIT_AS, &limit) != 0) return io_error("limit the memory of this process", errno);
#endif
  return {};
}

}  // namespace hueline::drivers::guest
