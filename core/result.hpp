#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace hueline {

/// What went wrong, for programs; the message is for people.
enum class ErrorCode : std::uint8_t {
  EndOfData,     ///< a recording ended as it should
  TimedOut,      ///< nothing came within the source's waiting time; not an error yet
  Stopped,       ///< a stop was asked for
  Disconnected,  ///< the device or peer went away
  Unavailable,   ///< could not be opened or reached now; may be later
  Malformed,     ///< bytes that break their format
  Truncated,     ///< ended in the middle
  Invalid,       ///< a value outside its range, a wrong argument or configuration
  Unsupported,   ///< well-formed, but not something we read
  Exhausted,     ///< a pool or queue is full
  Io,            ///< the operating system refused; message has errno in words
};
const char* name(ErrorCode code);

/// What, where, what to do.
struct Error {
  ErrorCode code = ErrorCode::Invalid;
  std::string message;
};

/// A value or an Error. Run-time trouble travels in it; exceptions are for start-up only and cross no thread.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return *std::get_if<0>(&state_); }
  const T& value() const& { return *std::get_if<0>(&state_); }
  T&& value() && { return std::move(*std::get_if<0>(&state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return *std::get_if<1>(&state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}
  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};
using Status = Result<void>;

/// Error{Io} that says what was attempted, on what, and the errno in words.
Error io_error(const std::string& attempted, int errno_value);

}  // namespace hueline
