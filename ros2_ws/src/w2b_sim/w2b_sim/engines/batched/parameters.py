"""What may differ from lane to lane: columns of the parameters, and streams of random numbers."""

#: Of every kernel.
(ERP_PER_H, SLIP, FRICTION, GRAVITY, BASE_MASS, TOUCH_GAP, DELAY, FLIP, PUSH, GAIN,
 MOTOR_NOISE) = range(11)
PARAMETERS = 11
#: Of leaky networks: factors of the servos' speed and torque; whether targets are one control
#: period late; sine and cosine of the heading to hold, from the one at the command; what the
#: gyro's estimated heading drifts by in a period, on average and at random, rad; the same of the
#: rate of turn that is felt, rad/s; random errors of the direction of gravity.
(SPEED, TORQUE, LATE, OFFSET_SIN, OFFSET_COS, DRIFT, DRIFT_NOISE, RATE_BIAS, RATE_NOISE,
 GRAVITY_NOISE) = range(PARAMETERS, PARAMETERS + 10)
LEAKY_PARAMETERS = PARAMETERS + 10
#: Their values where nothing deviates.
NOMINAL_LEAKY = (1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)

#: Random numbers per control period: the joints', two of the push, the touch sensors' and the
#: IMU's: gyro, then gravity's three.
MOTOR_STREAM, PUSH_STREAM, TOUCH_STREAM, IMU_STREAM, STREAMS = 0, 64, 66, 124, 128
