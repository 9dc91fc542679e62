// SPDX-License-Identifier: Apache-2.0
#include "chip_tlm.hpp"

#include <array>
#include <span>

namespace meltstage::systemc {

namespace {

constexpr unsigned kWordBytes = 2;

std::uint64_t address_of(const tlm::tlm_generic_payload& payload) {
  return payload.get_address() / kWordBytes;
}
unsigned words_of(const tlm::tlm_generic_payload& payload) { return payload.get_data_length() / kWordBytes; }

bool in_map(std::uint64_t address) {
  using namespace chip::spec;
  return address < kInputCount || (address >= kHoldingBase && address < kHoldingBase + kHoldingCount);
}

void put_word(unsigned char* data, std::uint16_t word) {
  data[0] = static_cast<unsigned char>(word & 0xFFu);
  data[1] = static_cast<unsigned char>(word >> 8);
}
std::uint16_t get_word(const unsigned char* data) {
  return static_cast<std::uint16_t>(data[0] | data[1] << 8);
}

// What can be said of an access without asking the chip.
tlm::tlm_response_status judge_form(const tlm::tlm_generic_payload& payload) {
  const unsigned length = payload.get_data_length();
  if (!payload.is_read() && !payload.is_write()) return tlm::TLM_COMMAND_ERROR_RESPONSE;
  if (payload.get_byte_enable_ptr() != nullptr) return tlm::TLM_BYTE_ENABLE_ERROR_RESPONSE;
  if (payload.get_address() % kWordBytes != 0 || !in_map(address_of(payload)))
    return tlm::TLM_ADDRESS_ERROR_RESPONSE;
  const unsigned most = kWordBytes * (payload.is_read() ? chip::spec::kMaxRead : chip::spec::kWriteWords);
  if (length == 0 || length % kWordBytes != 0 || length > most || payload.get_streaming_width() < length)
    return tlm::TLM_BURST_ERROR_RESPONSE;
  return tlm::TLM_OK_RESPONSE;
}

tlm::tlm_response_status status_of(chip::spec::Exception exception) {
  switch (exception) {
    case chip::spec::kExcNone:
      return tlm::TLM_OK_RESPONSE;
    case chip::spec::kExcAddress:
      return tlm::TLM_ADDRESS_ERROR_RESPONSE;
    default:
      return tlm::TLM_GENERIC_ERROR_RESPONSE;
  }
}

}  // namespace

TcChipTlm::TcChipTlm(const sc_core::sc_module_name& name) : sc_core::sc_module(name) {
  socket.register_b_transport(this, &TcChipTlm::b_transport);
  socket.register_transport_dbg(this, &TcChipTlm::transport_dbg);
}

chip::spec::Exception TcChipTlm::access(tlm::tlm_generic_payload& payload) {
  const auto address = static_cast<std::uint16_t>(address_of(payload));
  const unsigned words = words_of(payload);
  unsigned char* const data = payload.get_data_ptr();
  std::array<std::uint16_t, chip::spec::kMaxRead> buffer{};
  const std::span<std::uint16_t> values = std::span(buffer).first(words);
  if (payload.is_write()) {
    for (unsigned i = 0; i < words; ++i) values[i] = get_word(data + kWordBytes * i);
    return chip::host_write(pins.chip(), address, values);
  }
  const chip::spec::Exception exception = chip::host_read(pins.chip(), address, values);
  if (exception == chip::spec::kExcNone) {
    for (unsigned i = 0; i < words; ++i) put_word(data + kWordBytes * i, values[i]);
  }
  return exception;
}

void TcChipTlm::b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time&) {
  payload.set_dmi_allowed(false);
  tlm::tlm_response_status status = judge_form(payload);
  if (status == tlm::TLM_OK_RESPONSE) {
    exception_ = access(payload);
    status = status_of(exception_);
  }
  payload.set_response_status(status);
}

// Returns the bytes read: whole registers from the address on, up to the end of their space.
unsigned TcChipTlm::transport_dbg(tlm::tlm_generic_payload& payload) {
  if (!payload.is_read() || payload.get_address() % kWordBytes != 0) return 0;
  const std::uint64_t first = address_of(payload);
  unsigned words = 0;
  while (words < words_of(payload) && in_map(first + words)) {
    put_word(payload.get_data_ptr() + kWordBytes * words,
             pins.chip().read_register(static_cast<std::uint16_t>(first + words)));
    ++words;
  }
  return kWordBytes * words;
}

}  // namespace meltstage::systemc
