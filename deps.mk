# made by tools/deps.sh
DEPS_CFLAGS := -isystem /usr/include/aravis-0.8 -isystem /usr/include/glib-2.0 -isystem /usr/lib/x86_64-linux-gnu/glib-2.0/include -isystem /usr/include/libmount -isystem /usr/include/blkid -isystem /usr/include/libxml2 -isystem /usr/include/libusb-1.0 -isystem /usr/include/eigen3 -pthread -DSPDLOG_SHARED_LIB -DSPDLOG_COMPILED_LIB -DSPDLOG_FMT_EXTERNAL  -isystem /usr/include/opencv4 -DCYCLOPS_GPIOD=1 -DSPDLOG_FMT_EXTERNAL
DEPS_LIBS := -laravis-0.8 -llcm -lgthread-2.0 -lglib-2.0 -lgpiod -lGeographicLib -lgio-2.0 -lgobject-2.0 -lglib-2.0 -lspdlog -pthread -lfmt  -lopencv_imgcodecs -lopencv_imgproc -lopencv_core
LCM_JAR := /usr/share/java/lcm.jar
