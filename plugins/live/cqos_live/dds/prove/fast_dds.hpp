// Fast DDS 2 and Fast DDS 3 under one set of names: those of 3 where the two differ. Everything else is the same in both.

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#if __has_include(<fastdds/config.hpp>)
#include <fastdds/config.hpp>
#else
#include <fastrtps/config.h>
#define FASTDDS_VERSION_MAJOR FASTRTPS_VERSION_MAJOR
#define FASTDDS_VERSION_STR FASTRTPS_VERSION_STR
#endif

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#if FASTDDS_VERSION_MAJOR >= 3

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/test_UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>

using namespace eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;

#else

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/test_UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::c_TimeInfinite;
using eprosima::fastrtps::Duration_t;
using eprosima::fastrtps::types::ReturnCode_t;
static const ReturnCode_t RETCODE_OK = ReturnCode_t::RETCODE_OK;
namespace rtps
{
using namespace eprosima::fastrtps::rtps;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;
using eprosima::fastdds::rtps::test_UDPv4TransportDescriptor;
}

#endif

// The data type of a sample: how a program writes one, and reads it again.
template<typename Sample>
class DataType : public TopicDataType
{
public:

    // The size is that of a whole payload, with the four bytes that say how it is encoded.
    DataType(const std::string& name, uint32_t size, bool keyed)
        : size_(size)
    {
#if FASTDDS_VERSION_MAJOR >= 3
        set_name(name);
        max_serialized_type_size = size;
        is_compute_key_provided = keyed;
#else
        setName(name.c_str());
        m_typeSize = size;
        m_isGetKeyDefined = keyed;
        auto_fill_type_information(false);
        auto_fill_type_object(false);
#endif
    }

#if FASTDDS_VERSION_MAJOR >= 3

    bool serialize(const void* const data, rtps::SerializedPayload_t& payload, DataRepresentationId_t) override
    {
        write(*static_cast<const Sample*>(data), payload);
        return true;
    }

    bool deserialize(rtps::SerializedPayload_t& payload, void* data) override
    {
        return read(payload, *static_cast<Sample*>(data));
    }

    uint32_t calculate_serialized_size(const void* const, DataRepresentationId_t) override
    {
        return size_;
    }

    void* create_data() override
    {
        return new Sample();
    }

    void delete_data(void* data) override
    {
        delete static_cast<Sample*>(data);
    }

    bool compute_key(rtps::SerializedPayload_t& payload, rtps::InstanceHandle_t& handle, bool) override
    {
        Sample sample;
        return read(payload, sample) && find_key(sample, handle);
    }

    bool compute_key(const void* const data, rtps::InstanceHandle_t& handle, bool) override
    {
        return find_key(*static_cast<const Sample*>(data), handle);
    }

#else

    bool serialize(void* data, rtps::SerializedPayload_t* payload) override
    {
        write(*static_cast<const Sample*>(data), *payload);
        return true;
    }

    bool deserialize(rtps::SerializedPayload_t* payload, void* data) override
    {
        return read(*payload, *static_cast<Sample*>(data));
    }

    std::function<uint32_t()> getSerializedSizeProvider(void*) override
    {
        return [this]() { return size_; };
    }

    void* createData() override
    {
        return new Sample();
    }

    void deleteData(void* data) override
    {
        delete static_cast<Sample*>(data);
    }

    bool getKey(void* data, rtps::InstanceHandle_t* handle, bool) override
    {
        return find_key(*static_cast<const Sample*>(data), *handle);
    }

#endif

protected:

    virtual void write(const Sample& sample, rtps::SerializedPayload_t& payload) = 0;

    virtual bool read(const rtps::SerializedPayload_t& payload, Sample& sample) = 0;

    // Return false where the type has no key.
    virtual bool find_key(const Sample&, rtps::InstanceHandle_t&)
    {
        return false;
    }

private:

    uint32_t size_;
};

// Notices the writers and readers of other participants, whether they match or not.
class DiscoveryListener : public DomainParticipantListener
{
public:

#if FASTDDS_VERSION_MAJOR >= 3

    void on_data_reader_discovery(
            DomainParticipant*, rtps::ReaderDiscoveryStatus status, const SubscriptionBuiltinTopicData& info,
            bool&) override
    {
        if (status == rtps::ReaderDiscoveryStatus::DISCOVERED_READER)
        {
            discovered(info.topic_name.to_string());
        }
    }

    void on_data_writer_discovery(
            DomainParticipant*, rtps::WriterDiscoveryStatus status, const PublicationBuiltinTopicData& info,
            bool&) override
    {
        if (status == rtps::WriterDiscoveryStatus::DISCOVERED_WRITER)
        {
            discovered(info.topic_name.to_string());
        }
    }

#else

    void on_subscriber_discovery(DomainParticipant*, rtps::ReaderDiscoveryInfo&& other) override
    {
        if (other.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER)
        {
            discovered(other.info.topicName().to_string());
        }
    }

    void on_publisher_discovery(DomainParticipant*, rtps::WriterDiscoveryInfo&& other) override
    {
        if (other.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER)
        {
            discovered(other.info.topicName().to_string());
        }
    }

#endif

protected:

    virtual void discovered(const std::string& topic) = 0;
};

inline bool sent(DataWriter* writer, void* sample)
{
#if FASTDDS_VERSION_MAJOR >= 3
    return writer->write(sample) == RETCODE_OK;
#else
    return writer->write(sample);
#endif
}

inline void accept(DataReaderQos& qos, const std::vector<DataRepresentationId_t>& representations)
{
#if FASTDDS_VERSION_MAJOR >= 3
    qos.representation().m_value = representations;
#else
    qos.type_consistency().representation.m_value = representations;
#endif
}

inline void acknowledge_nothing(DataReaderQos& qos)
{
#if FASTDDS_VERSION_MAJOR >= 3
    qos.reliable_reader_qos().disable_positive_acks.enabled = true;
#else
    qos.reliable_reader_qos().disable_positive_ACKs.enabled = true;
#endif
}
