#pragma once

namespace hueline::apps {

/// Replaces this process by `hueline-office`, which lies beside this program, with these words (argv, ended by a null
/// pointer). Returns only if that program cannot be started: it prints a sentence on standard error and returns the
/// exit status.
int run_office_program(char** argv);

}  // namespace hueline::apps
