#include "hil/gige_xml.hpp"

#include <cstdio>
#include <initializer_list>
#include <utility>

#include "hil/gige_registers.hpp"

namespace cyclops::hil {
namespace {

std::string hex(std::uint32_t v) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%x", v);
  return text;
}
std::string element(const char* name, const std::string& text) {
  return std::string("<") + name + ">" + text + "</" + name + ">";
}
std::string place(std::uint32_t address, const char* access, int length = 4) {
  return element("Address", hex(address)) + element("Length", std::to_string(length)) + element("AccessMode", access) +
         element("pPort", "Device");
}
std::string node(const char* type, const std::string& name, const std::string& body) {
  return std::string("<") + type + " Name=\"" + name + "\" NameSpace=\"Standard\">" + body + "</" + type + ">\n";
}
std::string int_register(const std::string& name, std::uint32_t address, const char* access) {
  return node("IntReg", name, place(address, access) + element("Sign", "Unsigned") + element("Endianess", "BigEndian"));
}
std::string text_register(const std::string& name, std::uint32_t address, int length) {
  return node("StringReg", name, place(address, "RO", length));
}
/// An integer in [low, high] over a register of its own.
std::string integer(const std::string& name, std::uint32_t address, const char* access, long low, long high, int step = 1) {
  return node("Integer", name, element("pValue", name + "Reg") + element("Min", std::to_string(low)) +
                                   element("Max", std::to_string(high)) + element("Inc", std::to_string(step))) +
         int_register(name + "Reg", address, access);
}
std::string real(const std::string& name, std::uint32_t address, const char* unit, const char* low, const char* high) {
  return node("Float", name, element("pValue", name + "Reg") + element("Min", low) + element("Max", high) + element("Unit", unit)) +
         node("FloatReg", name + "Reg", place(address, "RW") + element("Endianess", "BigEndian"));
}
std::string command(const std::string& name, const char* target, unsigned value) {
  return node("Command", name, element("pValue", target) + element("CommandValue", std::to_string(value)));
}
using Entries = std::initializer_list<std::pair<const char*, std::uint32_t>>;
std::string choice(const std::string& name, const char* target, Entries entries) {
  std::string body;
  for (const auto& [entry, value] : entries)
    body += std::string("<EnumEntry Name=\"") + entry + "\" NameSpace=\"Standard\">" + element("Value", std::to_string(value)) + "</EnumEntry>";
  return node("Enumeration", name, body + element("pValue", target));
}
std::string category(const char* name, std::initializer_list<const char*> features) {
  std::string body;
  for (const char* f : features) body += element("pFeature", f);
  return node("Category", name, body);
}

std::string categories() {
  return category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "DigitalIOControl", "TransportLayerControl"}) +
         category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceSerialNumber", "DeviceID"}) +
         category("ImageFormatControl", {"SensorWidth", "SensorHeight", "Width", "Height", "OffsetX", "OffsetY", "PixelFormat"}) +
         category("AcquisitionControl", {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "AcquisitionFrameRate", "ExposureTime"}) +
         category("DigitalIOControl", {"LineSelector", "LineSource"}) +
         category("TransportLayerControl", {"PayloadSize", "GevSCPSPacketSize", "GevSCPSFireTestPacket", "GevSCPD",
                                            "GevHeartbeatTimeout", "GevTimestampControlLatch", "GevTimestampValue",
                                            "GevTimestampTickFrequency"});
}

std::string device_control() {
  return text_register("DeviceVendorName", 0x48, 32) + text_register("DeviceModelName", 0x68, 32) +
         text_register("DeviceVersion", 0x88, 32) + text_register("DeviceSerialNumber", 0xd8, 16) +
         text_register("DeviceID", 0xd8, 16);
}

std::string image_format(const GigeConfig& c) {
  return integer("SensorWidth", reg::kMaxWidth, "RO", 1, c.max_width) + integer("SensorHeight", reg::kMaxHeight, "RO", 1, c.max_height) +
         integer("Width", reg::kWidth, "RW", 1, c.max_width) + integer("Height", reg::kHeight, "RW", 1, c.max_height) +
         integer("OffsetX", reg::kOffsetX, "RW", 0, 0) + integer("OffsetY", reg::kOffsetY, "RW", 0, 0) +
         choice("PixelFormat", "PixelFormatReg",
                {{"Mono8", pfnc(PixelFormat::kMono8)}, {"Mono10", pfnc(PixelFormat::kMono10)},
                 {"Mono12", pfnc(PixelFormat::kMono12)}, {"Mono16", pfnc(PixelFormat::kMono16)}}) +
         int_register("PixelFormatReg", reg::kPixelFormat, "RW");
}

std::string acquisition() {
  return choice("AcquisitionMode", "AcquisitionModeReg", {{"Continuous", 0}}) +
         int_register("AcquisitionModeReg", reg::kAcquisitionMode, "RW") + command("AcquisitionStart", "AcquisitionReg", 1) +
         command("AcquisitionStop", "AcquisitionReg", 0) + int_register("AcquisitionReg", reg::kAcquisition, "RW") +
         real("AcquisitionFrameRate", reg::kFrameRate, "Hz", "0.1", "1000.0") +
         real("ExposureTime", reg::kExposure, "us", "1.0", "1000000.0");
}

std::string lines() {
  return choice("LineSelector", "LineSelectorReg", {{"Line0", 0}, {"Line1", 1}}) +
         int_register("LineSelectorReg", reg::kLineSelector, "RW") +
         choice("LineSource", "LineSourceReg", {{"Off", 0}, {"ExposureActive", 1}}) +
         node("IntReg", "LineSourceReg",
              element("Address", hex(reg::kLineSource0)) + "<pIndex Offset=\"4\">LineSelectorReg</pIndex>" + element("Length", "4") +
                  element("AccessMode", "RW") + element("pPort", "Device") + element("Sign", "Unsigned") +
                  element("Endianess", "BigEndian"));
}

/// An integer in the upper or lower part of a bootstrap register; bit 0 is the most significant.
std::string masked(const char* name, std::uint32_t address, int lsb, int msb) {
  return node("MaskedIntReg", name, place(address, "RW") + element("LSB", std::to_string(lsb)) +
                                        element("MSB", std::to_string(msb)) + element("Sign", "Unsigned") +
                                        element("Endianess", "BigEndian"));
}
std::string wide(const std::string& name, std::uint32_t address) {
  return node("IntReg", name, place(address, "RO", 8) + element("Sign", "Unsigned") + element("Endianess", "BigEndian"));
}

std::string transport(const GigeConfig& c) {
  return integer("PayloadSize", reg::kPayload, "RO", 0, 1L << 30) +
         node("Integer", "GevSCPSPacketSize", element("pValue", "PacketSizeReg") + element("Min", "576") +
                                                  element("Max", std::to_string(c.max_packet_bytes)) + element("Inc", "4")) +
         masked("PacketSizeReg", reg::kPacketSize, 31, 16) + command("GevSCPSFireTestPacket", "FireTestReg", 1) +
         masked("FireTestReg", reg::kPacketSize, 0, 0) + int_register("GevSCPD", reg::kPacketDelay, "RW") +
         int_register("GevHeartbeatTimeout", reg::kHeartbeat, "RW") + command("GevTimestampControlLatch", "TimestampControlReg", 2) +
         int_register("TimestampControlReg", reg::kTimestampControl, "WO") + wide("GevTimestampValue", reg::kLatchHigh) +
         wide("GevTimestampTickFrequency", 0x93c) + "<Port Name=\"Device\" NameSpace=\"Standard\"/>\n";
}

}  // namespace

std::string gige_xml(const GigeConfig& c) {
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<RegisterDescription ModelName=\"Bench\" VendorName=\"Cyclops\" StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" "
         "SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
         "ToolTip=\"Cyclops bench camera\" ProductGuid=\"0\" VersionGuid=\"0\" "
         "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n" +
         categories() + device_control() + image_format(c) + acquisition() + lines() + transport(c) + "</RegisterDescription>\n";
}

}  // namespace cyclops::hil
