# Packages of the libraries, except those that are linked by path. The project and the installed package both read
# this file; `lodestone_find` is find_package in the project and find_dependency in the package.

lodestone_find(Eigen3 3.4 NO_MODULE)
lodestone_find(TBB)
lodestone_find(Ceres 2.1)
lodestone_find(yaml-cpp)
lodestone_find(fmt)
lodestone_find(TIFF)
lodestone_find(OpenCV 4.5 COMPONENTS core imgproc imgcodecs)

# Log formats: CDR messages, SQLite bags, compressed chunks and checksums.
lodestone_find(fastcdr)
lodestone_find(SQLite3)
lodestone_find(BZip2)
lodestone_find(ZLIB)
