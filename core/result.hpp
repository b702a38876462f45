#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace hueline {

/// The kind of an error, for programs. The message is for people.
enum class ErrorCode : std::uint8_t {
  EndOfData,     ///< a recording ended normally
  TimedOut,      ///< nothing arrived within the waiting time; not yet an error
  Stopped,       ///< a stop was requested
  Disconnected,  ///< the device or peer is gone
  Unavailable,   ///< cannot be opened or reached now, but perhaps later
  Malformed,     ///< bytes that violate their format
  Truncated,     ///< the data end in the middle
  Invalid,       ///< a value out of range, or a wrong argument or configuration
  Unsupported,   ///< well-formed, but of a kind that is not read
  Exhausted,     ///< a pool or queue is full
  Io,            ///< the operating system refused; the message contains errno in words
};
const char* name(ErrorCode code);

/// An error: its kind, and a message that says what is wrong, where, and what to do.
struct Error {
  ErrorCode code = ErrorCode::Invalid;
  std::string message;
};

/// A value or an Error. Errors at run time are returned in it; exceptions are used at start-up only, and none crosses a
/// thread. `value()` requires ok(); `error()` requires !ok().
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

/// Returns an Error of kind Io. `attempted` says what was tried and on what; the message adds errno in words.
Error io_error(const std::string& attempted, int errno_value);

}  // namespace hueline
