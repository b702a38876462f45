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

namespace detail {
/// Says on standard error that the program asked a Result for what it does not hold, and aborts. `error`: what the
/// Result holds, or null if it holds a value.
[[noreturn]] void end_of_wrong_result(const Error* error);
}  // namespace detail

/// A value or an Error. Errors at run time are returned in it; exceptions are used at start-up only, and none crosses a
/// thread.
///
/// Ask ok() before value(), `*`, `->` or error(). Asking for the value of an error, or the error of a value, is an
/// error of programming: the program says which error was overlooked and aborts, in every build.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return const_cast<T&>(std::as_const(*this).value()); }
  const T& value() const& {
    if (const T* value = std::get_if<0>(&state_)) return *value;
    detail::end_of_wrong_result(&error());
  }
  T&& value() && { return std::move(value()); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const {
    if (const Error* error = std::get_if<1>(&state_)) return *error;
    detail::end_of_wrong_result(nullptr);
  }

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
  const Error& error() const {
    if (error_) return *error_;
    detail::end_of_wrong_result(nullptr);
  }

 private:
  std::optional<Error> error_;
};
using Status = Result<void>;

/// Returns an Error of kind Io. `attempted` says what was tried and on what; the message adds errno in words.
Error io_error(const std::string& attempted, int errno_value);

}  // namespace hueline
