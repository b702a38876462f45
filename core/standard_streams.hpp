#pragma once

#include "core/result.hpp"

namespace hueline {

/// Opens /dev/null on those of the descriptors 0, 1 and 2 that whoever started the program has closed. Every main calls
/// it first: otherwise the first file that is opened gets such a number, and what is meant for the terminal is written
/// into it.
void open_standard_streams();

/// Gives the operating system what waits in stdout and std::cout. Io if it, or any write to them before, was refused:
/// then the result is not where the user wants it. A terminal that was closed is no error: nobody is left who could
/// read. Call it last.
Status flush_standard_output();

}  // namespace hueline
