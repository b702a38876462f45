#include "sim/scenario.hpp"

namespace hueline::sim {

void StreetConfig::visit(Keys& keys) {
  keys.number({"road_width_m", "m", "The width of the road."}, road_width_m, {5, 30});
  keys.number({"pavement_width_m", "m", "The width of the pavement on each side."}, pavement_width_m, {1, 20});
  keys.number({"kerb_height_m", "m", "The height of the kerbs."}, kerb_height_m, {0.02, 0.3});
  keys.number({"curve_deg", "deg", "The whole angle of the street's bend, to the right; negative: to the left."},
              curve_deg, {-60, 60});
  keys.number({"curve_start_m", "m", "Where the bend begins, along the centre line from where the vehicle starts."},
              curve_start_m, {0, 10000});
  keys.number({"curve_length_m", "m", "The length of the bend."}, curve_length_m, {20, 10000});
  keys.number({"zebra_at_m", "m", "Where the crossing is, along the centre line."}, zebra_at_m, {-40, 10000});
  keys.number({"tree_spacing_m", "m", "The distance between trees."}, tree_spacing_m, {5, 1000});
  keys.number({"pole_spacing_m", "m", "The distance between lamp poles."}, pole_spacing_m, {5, 1000});
  keys.whole({"leaves_per_tree", "", "How many leaves a tree has."}, leaves_per_tree, {0, 20000});
  keys.whole({"parked_cars", "", "How many cars are parked."}, parked_cars, {0, 200});
  keys.whole({"moving_cars", "", "How many cars come towards the vehicle."}, moving_cars, {0, 20});
  keys.number({"moving_car_speed", "m/s", "The speed of the oncoming cars."}, moving_car_speed, {0, 30});
  keys.number({"sun_azimuth_deg", "deg", "The sun's azimuth, clockwise from north."}, sun_azimuth_deg, {0, 360});
  keys.number({"sun_elevation_deg", "deg", "The sun's height above the horizon."}, sun_elevation_deg, {5, 90});
  keys.number({"sky_brightness", "",
               "The light of the sky as seen, in multiples of the clear sky's. 3 saturates a camera that exposes for "
               "the street."},
              sky_brightness, {0.1, 20});
  keys.flag({"furnished", "", "Whether there is more than ground and facades."}, furnished);
  keys.choice({"car_paints", "",
               "The colours of the scene's cars: nine usual ones, or snow-white (reflectance 0.93) and black (0.012)."},
              car_paints, {{"usual", CarPaints::Usual}, {"black_and_white", CarPaints::BlackAndWhite}});
  keys.number({"wetness", "",
               "How wet roads and pavements are. Water darkens them and mirrors what is behind them, as Fresnel's "
               "formula says for a refractive index of 1.33: clearly in puddles, which grow with this number, and "
               "distorted and weaker between them."},
              wetness, {0, 1});
  keys.number({"daylight", "", "The light of sun and sky, on the scene and as seen, in multiples of a clear day's."},
              daylight, {0, 1});
  keys.number({"lamp_light", "",
               "The light of a street lamp on a white surface 1 m below it, in multiples of the sun's. 0: lamps are "
               "off."},
              lamp_light, {0, 100});
  keys.number({"car_lights", "",
               "The light of the headlights of each other vehicle that moves, as `drive.headlights`. 0: they are off."},
              car_lights, {0, 100});
  keys.number({"glazed_fronts", "",
               "The share of the houses that have panes of glass with a room behind them in their ground floor."},
              glazed_fronts, {0, 1});
  keys.number({"wire_mm", "mm",
               "The diameter of the wires above and across the road and of the stays of its lamp poles. 0: there are "
               "none."},
              wire_mm, {0, 100});
  keys.number(
      {"stake_spacing_m", "m", "The distance between stakes of 30 mm diameter on the pavements. 0: there are none."},
      stake_spacing_m, {0, 1000});
  keys.choice({"fence", "",
               "Fences along the kerbs, with gaps: bars of 20 mm every 120 mm, 1.1 m high; a chain link of 4 mm wire "
               "with meshes of 50 mm, 1.9 m high; or (both) bars on the right and the chain link on the left."},
              fence,
              {{"none", Fence::None}, {"bars", Fence::Bars}, {"chain_link", Fence::ChainLink}, {"both", Fence::Both}});
}

void TurnConfig::visit(Keys& keys) {
  keys.number({"at_m", "m",
               "The place of a U-turn along the centre line. The vehicle halts before and after it. Its radius is "
               "`drive.lane_offset_m`, which needs a wide road. Then the vehicle drives back on the other side, until "
               "the next turn."},
              at_m, {-40, 10000});
  keys.number({"for_s", "s", "How long the U-turn takes."}, for_s, {4, 60});
}

void DriveConfig::visit(Keys& keys) {
  keys.number({"heading_deg", "deg", "The heading of the street's first stretch, clockwise from north."}, heading_deg,
              {0, 360});
  keys.number({"lane_offset_m", "m",
               "How far right of the centre line the vehicle drives. It must leave 1 m to the road's edge."},
              lane_offset_m, {-10, 10});
  keys.number({"stand_s", "s", "How long the vehicle stands after the lead-in, before it moves."}, stand_s, {0, 600});
  keys.number({"accelerate_s", "s", "How long the vehicle takes to reach its speed."}, accelerate_s, {0.5, 60});
  keys.number({"speed", "m/s", "The speed of the vehicle."}, speed, {0.1, 30});
  keys.number({"brake_s", "s", "How long the vehicle takes to halt."}, brake_s, {0.5, 60});
  keys.number({"halt_s", "s", "How long the vehicle stands at the end."}, halt_s, {0, 600});
  keys.number({"imu_height_m", "m", "The height of the body's origin above the road."}, imu_height_m, {0.2, 3});
  keys.number(
      {"headlights", "",
       "The light of the vehicle's two headlights on a white surface 10 m ahead, in multiples of the sun's. They "
       "are dipped: little of their light goes above the horizon. 0: they are off."},
      headlights, {0, 100});
  keys.number({"roll_amplitude_deg", "deg",
               "The amplitude of the roll on the suspension. It fades in with the speed, like the next two."},
              roll_amplitude_deg, {0, 5});
  keys.number({"pitch_amplitude_deg", "deg", "The amplitude of the pitch on the suspension."}, pitch_amplitude_deg,
              {0, 5});
  keys.number({"heave_amplitude_m", "m", "The amplitude of the heave on the suspension."}, heave_amplitude_m, {0, 0.1});
  keys.list({"turns", "", "The U-turns, in the order in which they come.", "none"}, turns);
}

void InsOutage::visit(Keys& keys) {
  keys.number({"at_s", "s", "When a time without satellites begins, after the sensors' start."}, at_s, {0, 3600});
  keys.number({"for_s", "s", "The length of a time without satellites."}, for_s, {0.01, 3600});
}

void InsConfig::visit(Keys& keys) {
  keys.whole({"rate_hz", "Hz", "The rate of the solutions, a divisor of 1000."}, rate_hz, {1, 1000});
  keys.number({"position_sigma_m", "m",
               "One standard deviation of the slow error of the position in each axis (first-order Gauss-Markov)."},
              position_sigma_m, {0, 10});
  keys.number({"velocity_sigma", "m/s", "One standard deviation of the slow error of the velocity."}, velocity_sigma,
              {0, 10});
  keys.number({"roll_pitch_sigma_deg", "deg", "One standard deviation of the slow error of roll and pitch."},
              roll_pitch_sigma_deg, {0, 10});
  keys.number({"heading_sigma_deg", "deg", "One standard deviation of the slow error of the heading."},
              heading_sigma_deg, {0, 10});
  keys.number({"correlation_s", "s", "The correlation time of the slow errors."}, correlation_s, {0.1, 10000});
  keys.number({"position_white_m", "m", "One standard deviation of the additional white error of each position."},
              position_white_m, {0, 1});
  keys.number({"attitude_white_deg", "deg", "One standard deviation of the additional white error of each attitude."},
              attitude_white_deg, {0, 1});
  keys.choice({"grade", "",
               "The class of the product. Every class but custom sets the sigmas above and the five values below."},
              grade,
              {{"custom", InsGrade::Custom},
               {"pos_lv_220", InsGrade::PosLv220},
               {"pos_lv_420", InsGrade::PosLv420},
               {"span_cpt", InsGrade::SpanCpt}});
  keys.number({"gyro_bias_deg_h", "deg/h",
               "The residual bias of the gyros after the filter. It makes the attitude drift in an outage."},
              gyro_bias_deg_h, {0, 1000});
  keys.number({"angle_random_walk_deg_sqrt_h", "deg/sqrt(h)", "The angle random walk of the gyros."},
              angle_random_walk_deg_sqrt_h, {0, 10});
  keys.number({"velocity_random_walk_sqrt_h", "m/s/sqrt(h)", "The velocity random walk of the accelerometers."},
              velocity_random_walk_sqrt_h, {0, 10});
  keys.number({"accelerometer_bias_ug", "ug", "The residual bias of the accelerometers after the filter."},
              accelerometer_bias_ug, {0, 100000});
  keys.number({"wheel_s", "s",
               "The time constant with which a wheel sensor pulls the velocity back in an outage. 0: there is no wheel "
               "sensor."},
              wheel_s, {0, 1000});
  keys.number({"high_variance_m", "m", "The horizontal sigma from which the receiver reports INS_HIGH_VARIANCE."},
              high_variance_m, {0.01, 1000});
  keys.list({"outages", "", "The times without satellites.", "none"}, outages);
}

void PpsConfig::visit(Keys& keys) {
  keys.number({"jitter_us", "us", "One standard deviation of the edge's time stamp."}, jitter_us, {0, 10000});
  keys.number({"spike_probability", "", "The probability of a late interrupt."}, spike_probability, {0, 1});
  keys.number({"spike_us", "us", "The largest delay of a late interrupt."}, spike_us, {0, 100000});
}

void AlleyConfig::visit(Keys& keys) {
  keys.number({"near_m", "m", "The smallest distance of a wall from the vehicle's path."}, near_m, {1.3, 20});
  keys.number({"far_m", "m", "The largest distance of a wall from the vehicle's path."}, far_m, {1.3, 20});
}

void TrafficConfig::visit(Keys& keys) {
  keys.number({"spacing_m", "m",
               "The distance between oncoming vehicles of a lane. Each of two lanes has `street.moving_cars` of them."},
              spacing_m, {8, 1000});
  keys.whole({"overtaking_cars", "", "How many cars overtake, in the lane on the left."}, overtaking_cars, {0, 20});
  keys.number({"overtaking_speed", "m/s", "The speed of the overtaking cars."}, overtaking_speed, {0.1, 40});
  keys.whole({"pedestrians", "", "How many people walk on the pavements. Four more are on the crossing."}, pedestrians,
             {0, 100});
}

void GlassConfig::visit(Keys& keys) {
  keys.number({"refractive_index", "",
               "The refractive index of panes. Both surfaces of a pane reflect as Fresnel's formula says: 8 % together "
               "at normal incidence, half of the light at 80 degrees."},
              refractive_index, {1, 3});
  keys.number({"transmittance", "", "The share of the light that the glass of a pane does not absorb on one passage."},
              transmittance, {0, 1});
}

void RoadUserConfig::visit(Keys& keys) {
  keys.choice({"kind", "", "What the road user is. A lorry is 12.4 m long, 2.5 m wide and 4 m high."}, kind,
              {{"car", RoadUserKind::Car},
               {"van", RoadUserKind::Van},
               {"lorry", RoadUserKind::Lorry},
               {"person", RoadUserKind::Person}});
  keys.number({"at_m", "m", "Where its middle is along the centre line when the sensors start."}, at_m, {-1000, 10000});
  keys.number({"lateral_m", "m", "Its distance to the right of the centre line."}, lateral_m, {-20, 20});
  keys.number({"speed", "m/s", "Its speed, which it keeps. Negative: against the direction of the drive."}, speed,
              {-40, 40});
  keys.whole({"paint", "",
              "Its colour: 0 red, 1 blue, 2 white, 3 dark grey, 4 ochre, 5 green, 6 grey, 7 brown, 8 turquoise, 9 "
              "snow-white, 10 black."},
             paint, {0, 10});
}

void TunnelConfig::visit(Keys& keys) {
  keys.number({"from_m", "m", "Where the tunnel begins, along the centre line."}, from_m, {-40, 10000});
  keys.number({"length_m", "m", "The length of the tunnel."}, length_m, {5, 10000});
  keys.number({"height_m", "m", "The height of the tunnel."}, height_m, {3.5, 12});
  keys.number({"lamp_spacing_m", "m", "The distance between lamps, which hang in two rows and throw no shadows."},
              lamp_spacing_m, {2, 100});
}

void TargetsConfig::visit(Keys& keys) {
  keys.whole({"large", "", "How many spheres of 145 mm radius stand on tripods, 5 to 16 m away."}, large, {0, 40});
  keys.whole({"small", "", "How many spheres of 72.5 mm radius stand on tripods, 3.8 to 8 m away."}, small, {0, 40});
  keys.whole(
      {"decoys", "", "How many other things look like targets: balls of other sizes, domed posts, barrels, boulders."},
      decoys, {0, 40});
}

void MountConfig::visit(Keys& keys) {
  keys.number({"x_m", "m", "The sensor's place in Body: x right, y forward, z up, origin at the IMU."}, x_m, {-20, 20});
  keys.number({"y_m", "m", "See `x_m`."}, y_m, {-20, 20});
  keys.number({"z_m", "m", "See `x_m`."}, z_m, {-20, 20});
  keys.number({"rot_x_deg", "deg", "The sensor's attitude: R_body_sensor = Rz Ry Rx."}, rot_x_deg, {-360, 360});
  keys.number({"rot_y_deg", "deg", "See `rot_x_deg`."}, rot_y_deg, {-360, 360});
  keys.number({"rot_z_deg", "deg", "See `rot_x_deg`."}, rot_z_deg, {-360, 360});
}

void LaserConfig::visit(Keys& keys) {
  keys.choice({"model", "",
               "The scanner. `profile` has one rotating mirror (RIEGL VUX class) and draws lines across its axis z."},
              model, {{"vlp16", LaserModel::Vlp16}, {"hdl32e", LaserModel::Hdl32e}, {"profile", LaserModel::Profile}});
  keys.number({"rate_rpm", "1/min",
               "The rate of rotation. 0: the rate nearest to 600 at which the azimuths on the wire are exact."},
              rate_rpm, {0, 1200});
  keys.number({"lines_per_s", "1/s", "profile: turns of the mirror."}, lines_per_s, {1, 1000});
  keys.number({"points_per_s", "1/s", "profile: pulses, spread evenly over the turn."}, points_per_s, {10'000, 4e6});
  keys.number({"motor_jitter_deg", "deg", "One standard deviation of a block's reported azimuth."}, motor_jitter_deg,
              {0, 1});
  keys.number({"range_sigma_m", "m", "One standard deviation of a range."}, range_sigma_m, {0, 1});
  keys.number({"dropout_probability", "", "The probability that a return is missing."}, dropout_probability, {0, 1});
  keys.number({"min_range_m", "m", "Nearer surfaces give no return. It is below `max_range_m`."}, min_range_m, {0, 10});
  keys.number({"max_range_m", "m", "Farther surfaces give no return."}, max_range_m, {1, 130});
  keys.number(
      {"detection_range_m", "m",
       "The range at which a matt surface of reflectance 0.1 that faces the beam is only just measured. A return "
       "is missing if it is weaker than that: strength is reflectance x cosine of the incidence / range^2, and less "
       "behind panes. "
       "0: every surface up to `max_range_m` gives a return."},
      detection_range_m, {0, 1000});
  keys.flag(
      {"vertical_offsets", "", "VLP-16: whether the lasers start at the different heights that its manual lists."},
      vertical_offsets);
  keys.section({"mount", "", "Where the scanner sits."}, mount);
}

void WheelConfig::visit(Keys& keys) {
  keys.number(
      {"rate_hz", "Hz", "The rate of each of the encoder's two messages on the CAN bus. 0: the vehicle has none."},
      rate_hz, {0, 200});
  keys.number({"circumference_m", "m", "The circumference of a tyre."}, circumference_m, {0.5, 4});
  keys.number({"scale", "", "The distance that the encoder reports divided by the true one. Worn tyres change it."},
              scale, {0.5, 2});
  keys.whole({"pulses_per_turn", "", "How many pulses a wheel gives in one turn."}, pulses_per_turn, {1, 1000});
  keys.number({"track_m", "m", "The distance between the wheels of an axle."}, track_m, {0.5, 4});
  keys.number({"speed_sigma", "m/s", "One standard deviation of the white error of each wheel's speed."}, speed_sigma,
              {0, 1});
}

void LensConfig::visit(Keys& keys) {
  keys.number({"rot_x", "rad", "The lens's attitude: R_head_lens = Rz Ry Rx."}, rot_x, {-7, 7});
  keys.number({"rot_y", "rad", "See `rot_x`."}, rot_y, {-7, 7});
  keys.number({"rot_z", "rad", "See `rot_x`."}, rot_z, {-7, 7});
  keys.number({"trans_x_m", "m", "The lens's place in the head."}, trans_x_m, {-2, 2});
  keys.number({"trans_y_m", "m", "See `trans_x_m`."}, trans_y_m, {-2, 2});
  keys.number({"trans_z_m", "m", "See `trans_x_m`."}, trans_z_m, {-2, 2});
  keys.number(
      {"focal_px", "px", "The focal length in the 2448 x 2048 rectified image. It is scaled to the lens image."},
      focal_px, {10, 100000});
  keys.number({"centre_x_px", "px", "The column of the principal point in the rectified image."}, centre_x_px,
              {0, 10000});
  keys.number({"centre_y_px", "px", "The row of the principal point in the rectified image."}, centre_y_px, {0, 10000});
}

void HeadDriftConfig::visit(Keys& keys) {
  keys.number({"at_s", "s", "When the head drifts, after the sensors' start."}, at_s, {0, 36000});
  keys.number({"rot_x_deg", "deg", "The head's rotation about its own axes: Rz Ry Rx, after that of its mounting."},
              rot_x_deg, {-10, 10});
  keys.number({"rot_y_deg", "deg", "See `rot_x_deg`."}, rot_y_deg, {-10, 10});
  keys.number({"rot_z_deg", "deg", "See `rot_x_deg`."}, rot_z_deg, {-10, 10});
  keys.number({"late_us", "us", "How much later than the strobe says the images are taken."}, late_us, {-50000, 50000});
}

void CameraConfig::visit(Keys& keys) {
  keys.number({"rate_hz", "Hz", "The rate of exposures."}, rate_hz, {0.1, 60});
  keys.number({"first_exposure_s", "s", "The first exposure, after the sensors' start."}, first_exposure_s, {0, 10});
  keys.number({"exposure_us", "us", "The length of an exposure, shorter than the time between exposures."}, exposure_us,
              {1, 100000});
  keys.number(
      {"strobe_jitter_us", "us", "One standard deviation of the POS's event mark against the exposure's true start."},
      strobe_jitter_us, {0, 1000});
  keys.whole({"blur_samples", "", "How many poses are averaged over an exposure. 1: no motion blur."}, blur_samples,
             {1, 32});
  keys.whole({"lens_width", "px", "The width of a lens image, an even number."}, lens_width, {16, 8192});
  keys.whole({"lens_height", "px", "The height of a lens image, an even number."}, lens_height, {16, 8192});
  keys.whole({"stack_columns", "",
              "How many lens images stand side by side. Lens i stands in column i % columns and row i / columns of the "
              "image."},
             stack_columns, {1, 16});
  keys.whole({"stack_rows", "", "How many rows of lens images there are. Columns x rows must hold every lens."},
             stack_rows, {1, 16});
  keys.choice({"lens_model", "", "The lens model."}, lens_model,
              {{"kannala_brandt", LensModel::KannalaBrandt}, {"brown", LensModel::Brown}});
  keys.choice({"tone_curve", "", "How light becomes a pixel's value."}, tone_curve,
              {{"linear", ToneCurve::Linear}, {"srgb", ToneCurve::Srgb}});
  keys.number({"gain", "", "The gain of the camera. At 1 a white wall in the sun is just below saturation."}, gain,
              {0.01, 100});
  keys.number({"vignetting", "", "The share of light that is lost at the far corner of a lens image."}, vignetting,
              {0, 0.9});
  keys.number({"full_well_electrons", "", "The electrons of a saturated pixel, which make the shot noise."},
              full_well_electrons, {100, 1e6});
  keys.number({"read_noise_electrons", "", "One standard deviation of the read noise."}, read_noise_electrons,
              {0, 1000});
  keys.flag({"antialias", "", "Whether pixels along outlines have four samples."}, antialias);
  keys.choice({"shutter", "", "Whether all rows are exposed at once, or (rolling) one after the other."}, shutter,
              {{"global", ShutterKind::Global}, {"rolling", ShutterKind::Rolling}});
  keys.number({"row_time_us", "us",
               "rolling: the time from one row of a lens image to the next. The strobe belongs to the middle row."},
              row_time_us, {0.1, 1000});
  keys.flag({"auto_exposure", "",
             "Whether each lens adapts its own gain from image to image. The truth contains these gains."},
            auto_exposure);
  keys.choice(
      {"auto_exposure_sets", "",
       "What automatic exposure changes: the amplification of each lens (`gains`), the time that the whole head "
       "is exposed (`shutter`), or the time that each lens is (`shutters`). `exposure_us` is the time at the "
       "factor 1, and all lenses begin at one time."},
      auto_exposure_sets,
      {{"gains", AutoSets::Gains}, {"shutter", AutoSets::Shutter}, {"shutters", AutoSets::Shutters}});
  keys.flag({"reports_exposure", "",
             "Whether the camera writes into each image how it was exposed: with `payload: raw` the shutter and gain "
             "of all lenses (not with `auto_exposure_sets: gains` or `shutters`), with `jpeg_planes` those of each."},
            reports_exposure);
  keys.number({"auto_exposure_target", "",
               "The mean of the delivered light (linear, 1 saturates) at which automatic exposure aims."},
              auto_exposure_target, {0.01, 0.9});
  keys.number({"auto_exposure_rate", "", "The share of the logarithmic error that each image removes."},
              auto_exposure_rate, {0.01, 1});
  keys.number({"auto_exposure_limit", "",
               "The largest factor on `camera.gain` or `camera.exposure_us`. The smallest is its inverse."},
              auto_exposure_limit, {1, 1000});
  keys.choice({"payload", "",
               "What the camera sends: the mosaic, or 24 JPEGs an exposure ([formats](formats.md#jpeg-planes)), as a "
               "Ladybug's JPEG modes do. Then `stack_columns` x "
               "`stack_rows` is 1 x 6, 2 x 3, 3 x 2 or 6 x 1."},
              payload, {{"raw", ImagePayload::Raw}, {"jpeg_planes", ImagePayload::JpegPlanes}});
  keys.whole({"jpeg_quality", "", "The quality of the JPEGs."}, jpeg_quality, {1, 100});
  keys.section({"mount", "", "Where the head sits."}, mount);
  keys.section({"drift", "", "A drift of the head that its calibration does not know of.", "none"}, drift);
  keys.list({"lenses", "", "The lenses. A list replaces all default lenses.", "a Ladybug5's six lenses"}, lenses);
}

void Scenario::visit(Keys& keys) {
  keys.whole({"seed", "", "The seed of every random number."}, seed, {0, 1e15});
  keys.number({"duration_s", "s", "How long laser and camera run."}, duration_s, {0.5, 3600});
  keys.number(
      {"lead_in_s", "s", "How long POS and PPS run before that, in whole seconds. Meanwhile the vehicle stands."},
      lead_in_s, {1, 600});
  keys.flag({"noise", "", "Whether there are random errors. Quantisation on the wire stays in any case."}, noise);
  keys.whole({"start_gps_week", "week", "The full GPS week of the start, not modulo 1024."}, start_gps_week,
             {1, 10000});
  keys.whole(
      {"start_time_of_week_s", "s", "The second of that week. With the default a full UTC hour begins 15 s later."},
      start_time_of_week_s, {0, 604799});
  keys.number({"origin_latitude_deg", "deg", "The latitude of the road where the street begins."}, origin_latitude_deg,
              {-89, 89});
  keys.number({"origin_longitude_deg", "deg", "The longitude of that place."}, origin_longitude_deg, {-180, 180});
  keys.number({"origin_height_m", "m", "The height of that place above the ellipsoid."}, origin_height_m, {-500, 9000});
  keys.choice({"scene", "", "What the vehicle drives through."}, scene,
              {{"street", SceneKind::Street},
               {"square", SceneKind::Square},
               {"canyon", SceneKind::Canyon},
               {"alley", SceneKind::Alley},
               {"traffic", SceneKind::Traffic},
               {"tunnel", SceneKind::Tunnel},
               {"targets", SceneKind::Targets}});
  keys.section({"street", "", "The street, and sun, trees and road of the other scenes."}, street);
  keys.section({"alley", "", "The settings of the scene `alley`."}, alley);
  keys.section({"traffic", "", "The settings of the scene `traffic`."}, traffic);
  keys.section({"tunnel", "", "The settings of the scene `tunnel`."}, tunnel);
  keys.section({"targets", "", "The settings of the scene `targets`."}, targets);
  keys.section({"glass", "", "The panes of glass."}, glass);
  keys.list({"road_users", "", "Road users in addition to those of the scene.", "none"}, road_users);
  keys.section({"drive", "", "The motion of the vehicle."}, drive);
  keys.section({"ins", "", "The POS."}, ins);
  keys.section({"pps", "", "The pulse per second."}, pps);
  keys.section({"laser", "", "The scanner."}, laser);
  keys.section({"camera", "", "The camera head."}, camera);
  keys.section({"wheel", "", "The wheel encoder."}, wheel);
}

}  // namespace hueline::sim
