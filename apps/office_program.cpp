#include "apps/office_program.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "apps/exit_code.hpp"
#include "core/child.hpp"
#include "core/standard_streams.hpp"

namespace hueline::apps {

int run_office_program(char** argv) {
  open_standard_streams();
  const std::string program = program_beside_this("hueline-office").string();
  execv(program.c_str(), argv);
  std::fprintf(stderr,
               "hueline: '%s' is a command of %s, which cannot be started: %s; install it beside this program\n",
               argv[1], program.c_str(), std::strerror(errno));
  return kFailed;
}

}  // namespace hueline::apps
