#pragma once

#include "core/result.hpp"

namespace hueline {

/// Opens /dev/null on each of the descriptors 0, 1 and 2 that is closed when the program starts. Every main() calls it
/// first. Otherwise the first file that the program opens would get such a number, and text for the terminal would be
/// written into it.
void open_standard_streams();

/// Writes out what is buffered in stdout and std::cout. Every main() calls it last. Errors: Io if this or an earlier
/// write to them was refused, because then the user does not have the result. A terminal that was closed is not an
/// error: nobody can read there.
Status flush_standard_output();

}  // namespace hueline
