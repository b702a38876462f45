#include "drivers/velodyne/velodyne_model.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::nanoseconds;

constexpr VelodyneTable kVlp16{"VLP-16",
                               0x22,
                               16,
                               nanoseconds(2304),
                               nanoseconds(55296),
                               0.002,
                               {{{-15, 11.2},
                                 {1, -0.7},
                                 {-13, 9.7},
                                 {3, -2.2},
                                 {-11, 8.1},
                                 {5, -3.7},
                                 {-9, 6.6},
                                 {7, -5.1},
                                 {-7, 5.1},
                                 {9, -6.6},
                                 {-5, 3.7},
                                 {11, -8.1},
                                 {-3, 2.2},
                                 {13, -9.7},
                                 {-1, 0.7},
                                 {15, -11.2}}}};

constexpr VelodyneTable kHdl32e{
    "HDL-32E",
    0x21,
    32,
    nanoseconds(1152),
    nanoseconds(46080),
    0.002,
    {{{-30.67, 0}, {-9.33, 0}, {-29.33, 0}, {-8.00, 0}, {-28.00, 0}, {-6.67, 0}, {-26.67, 0}, {-5.33, 0},
      {-25.33, 0}, {-4.00, 0}, {-24.00, 0}, {-2.67, 0}, {-22.67, 0}, {-1.33, 0}, {-21.33, 0}, {0.00, 0},
      {-20.00, 0}, {1.33, 0},  {-18.67, 0}, {2.67, 0},  {-17.33, 0}, {4.00, 0},  {-16.00, 0}, {5.33, 0},
      {-14.67, 0}, {6.67, 0},  {-13.33, 0}, {8.00, 0},  {-12.00, 0}, {9.33, 0},  {-10.67, 0}, {10.67, 0}}}};

}  // namespace

const VelodyneTable& velodyne_table(VelodyneModel model) { return model == VelodyneModel::Hdl32e ? kHdl32e : kVlp16; }

}  // namespace hueline::drivers
