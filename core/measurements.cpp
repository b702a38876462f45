#include "core/measurements.hpp"

#include "core/coloured_point.hpp"
#include "core/stamped.hpp"

namespace hueline {

const char* name(FixType type) {
  switch (type) {
    case FixType::None:
      return "None";
    case FixType::Single:
      return "Single";
    case FixType::Dgnss:
      return "Dgnss";
    case FixType::RtkFloat:
      return "RtkFloat";
    case FixType::RtkFixed:
      return "RtkFixed";
    case FixType::Ppp:
      return "Ppp";
  }
  return "?";
}

const char* name(PixelFormat format) {
  switch (format) {
    case PixelFormat::Mono8:
      return "Mono8";
    case PixelFormat::BayerRG8:
      return "BayerRG8";
    case PixelFormat::BayerBG8:
      return "BayerBG8";
    case PixelFormat::BayerGR8:
      return "BayerGR8";
    case PixelFormat::BayerGB8:
      return "BayerGB8";
    case PixelFormat::Rgb8:
      return "Rgb8";
  }
  return "?";
}

const char* name(ExposureTiming timing) {
  switch (timing) {
    case ExposureTiming::EventMark:
      return "EventMark";
    case ExposureTiming::CameraClock:
      return "CameraClock";
    case ExposureTiming::Unmatched:
      return "Unmatched";
  }
  return "?";
}

const char* name(ColourState state) {
  switch (state) {
    case ColourState::Direct:
      return "Direct";
    case ColourState::Neighbour:
      return "Neighbour";
    case ColourState::NoExposure:
      return "NoExposure";
    case ColourState::Outside:
      return "Outside";
    case ColourState::NoPose:
      return "NoPose";
    case ColourState::Hidden:
      return "Hidden";
  }
  return "?";
}

}  // namespace hueline
