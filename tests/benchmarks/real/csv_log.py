"""Files of logs that `lodestone run` reads as CSV."""
import numpy as np

COLUMNS = {
    "imu": "time_s,gyroscope_x_rad_s,gyroscope_y_rad_s,gyroscope_z_rad_s,accelerometer_x_m_s2,accelerometer_y_m_s2,"
           "accelerometer_z_m_s2",
    "mag": "time_s,field_x_ut,field_y_ut,field_z_ut",
}


def write(path, columns, time_s, values):
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack([time_s, values]), fmt="%.6f", delimiter=",", header=columns, comments="")
